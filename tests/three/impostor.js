// A hemi-octahedral impostor for three.js, from finished textures instead of a bake in the browser.
// The layout is that of https://github.com/agargaro/octahedral-impostor.
import { LinearSRGBColorSpace, Mesh, NoColorSpace, PlaneGeometry, ShaderMaterial, SRGBColorSpace, TextureLoader, Vector3 } from 'three';

// Tile (column, row) of n × n shows the object from gridToDir(tile / (n - 1)). Its lower left corner has the
// texture coordinates tile / n: row 0 is at v = 0, the bottom of a PNG.
const layout = /* glsl */`
  vec2 dirToGrid(vec3 d) {
    d /= abs(d.x) + abs(d.y) + abs(d.z);
    return 0.5 + 0.5 * vec2(d.z + d.x, d.z - d.x);
  }

  vec3 gridToDir(vec2 g) {
    vec2 p = vec2(g.x - g.y, g.x + g.y - 1.0);
    return normalize(vec3(p.x, 1.0 - abs(p.x) - abs(p.y), p.y));
  }

  // A tile's right, its up, and the direction towards its camera.
  mat3 frameOf(vec3 dir) {
    vec3 right = normalize(cross(dir.y > 0.999 ? vec3(-1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0), dir));
    return mat3(right, cross(dir, right), dir);
  }
`;

const vertexShader = /* glsl */`
  flat out vec3 eye;
  flat out mat3 world;
  out vec3 place;
  ${layout}
  void main() {
    eye = (inverse(modelMatrix) * vec4(cameraPosition, 1.0)).xyz;
    world = mat3(modelMatrix);
    place = frameOf(normalize(eye)) * position;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(place, 1.0);
  }
`;

const fragmentShader = /* glsl */`
  uniform sampler2D map;
  uniform sampler2D normalDepth;
  uniform float tiles;
  uniform float cutoff;
  uniform bool premultiplied;
  uniform int show;
  uniform vec3 light;
  flat in vec3 eye;
  flat in mat3 world;
  in vec3 place;
  ${layout}
  void main() {
    vec2 grid = dirToGrid(normalize(eye)) * (tiles - 1.0);
    vec2 near = clamp(floor(grid), vec2(0.0), vec2(tiles - 2.0));
    vec2 f = grid - near;
    vec2 tile[3] = vec2[3](near, near + (f.x > f.y ? vec2(1.0, 0.0) : vec2(0.0, 1.0)), near + 1.0);
    vec3 weight = vec3(1.0 - max(f.x, f.y), abs(f.x - f.y), min(f.x, f.y));

    vec3 ray = place - eye;
    float halfTexel = 0.5 * tiles / float(textureSize(map, 0).x);
    vec4 color = vec4(0.0);
    vec3 normal = vec3(0.0);
    for (int i = 0; i < 3; i++) {
      mat3 frame = frameOf(gridToDir(tile[i] / (tiles - 1.0)));
      vec3 hit = eye - ray * dot(eye, frame[2]) / dot(ray, frame[2]);
      vec2 uv = vec2(dot(hit, frame[0]), dot(hit, frame[1])) + 0.5;
      vec2 at = (tile[i] + clamp(uv, halfTexel, 1.0 - halfTexel)) / tiles;
      vec4 texel = texture(map, at);
      vec3 facing = texture(normalDepth, at).xyz * 2.0 - 1.0;
      if (!premultiplied) texel.rgb *= texel.a;
      if (any(greaterThan(abs(uv - 0.5), vec2(0.5 + halfTexel)))) texel = vec4(0.0);
      color += weight[i] * texel;
      normal += weight[i] * texel.a * (frame * facing);
    }
    if (color.a <= cutoff) discard;
    normal = normalize(world * normal);
    gl_FragColor = vec4(color.rgb / color.a, 1.0);
    if (show == 1) gl_FragColor.rgb *= 0.25 + 0.75 * max(0.0, dot(normal, light));
    #include <colorspace_fragment>
    if (show == 2) gl_FragColor.rgb = 0.5 + 0.5 * normal;
  }
`;

export const SHOW = { albedo: 0, lit: 1, normal: 2 };

/** The impostor of a folder by the name of its side file. */
export async function loadImpostor(folder, file, show) {
  const info = await (await fetch(`${folder}/${file}`)).json();
  const loader = new TextureLoader();
  const load = (name) => loader.loadAsync(`${folder}/${name}`);
  const [map, normalDepth] = await Promise.all(info.textures.map(load));
  map.colorSpace = info.albedoColorSpace === 'linear' ? LinearSRGBColorSpace : SRGBColorSpace;
  normalDepth.colorSpace = NoColorSpace;

  const material = new ShaderMaterial({
    vertexShader, fragmentShader,
    uniforms: {
      map: { value: map }, normalDepth: { value: normalDepth }, tiles: { value: info.tilesPerSide },
      cutoff: { value: info.alphaCutoff ?? 0.4 }, premultiplied: { value: info.premultiplied ?? false },
      show: { value: SHOW[show] }, light: { value: new Vector3(1, 2, 3).normalize() },
    },
  });
  const mesh = new Mesh(new PlaneGeometry(), material);
  mesh.frustumCulled = false; // The vertex shader turns the plane.
  mesh.position.fromArray(info.center);
  mesh.scale.setScalar(2 * info.radius);
  return { mesh, info };
}
