use crate::support::{arg, inspect, repo, run, succeed};

#[test]
fn several_trees_become_one_block_by_arguments_or_by_file() {
    let dir = tempfile::tempdir().unwrap();
    let [by_args, by_file] = ["a.fpack", "b.fpack"].map(|n| dir.path().join(n));
    let conifer = arg(&repo("sample-data/conifer.glb"));
    let shrub = arg(&repo("sample-data/shrub.obj"));
    let placed = format!("{shrub}@3,0,1:yaw=40,scale=1.2");
    succeed(&["points", &conifer, &placed, &format!("{shrub}@-3,0,0"), "-o", &arg(&by_args), "-q"]);
    let toml = format!(
        "[[tree]]\nfile = {conifer:?}\n[[tree]]\nfile = {shrub:?}\nat = [3.0, 0.0, 1.0]\nyaw = 40.0\nscale = 1.2\n\
         [[tree]]\nfile = {shrub:?}\nat = [-3.0, 0.0, 0.0]\n"
    );
    std::fs::write(dir.path().join("block.toml"), toml).unwrap();
    succeed(&["points", &arg(&dir.path().join("block.toml")), "-o", &arg(&by_file), "-q"]);
    assert_eq!(std::fs::read(&by_args).unwrap(), std::fs::read(&by_file).unwrap());

    let report = inspect(&by_args);
    assert_eq!(report["points"]["counts"]["source_triangles"], 20_000 + 2 * 4_000);
    assert_eq!(report["sources"][1]["placement"], "3,0,1:yaw=40,scale=1.2");
    // A group gets the finer grid: up to 1,024 cells.
    let grid: Vec<u64> =
        report["points"]["grid"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
    assert!(grid.iter().product::<u64>() > 500, "{grid:?}");
    let (code, _, err) = run(&["points", &format!("{shrub}@1,2"), "-o", &arg(&by_args)]);
    assert!(code == 3 && err.contains("2 coordinates"), "{err}");
}
