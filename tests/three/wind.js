// Bends a level of foliage by the wind's attributes of its glb: what an engine's vertex shader would do, on the CPU.
import { Quaternion, Vector3 } from 'three';

const STEPS = 16;

const up = new Vector3(0, 1, 0);
const direction = new Vector3(1, 0, 0);
const side = direction.clone().cross(up);

/** The wind of a loaded glb; undefined if it has none. */
export async function windOf(parser) {
  const info = parser.json.nodes[0].extras?.forest_wind;
  if (!info) return undefined;
  const view = new DataView(await parser.getDependency('bufferView', info.bufferView));
  const origin = new Vector3(...info.origin);
  const branches = Array.from({ length: info.branches }, (_, i) => {
    const f = (word) => view.getFloat32(i * info.byteStride + 4 * word, true);
    const v = (word) => new Vector3(f(word), f(word + 1), f(word + 2));
    const parent = view.getUint32(i * info.byteStride + 12, true);
    return { base: v(0).add(origin), parent, linear: v(4), at: f(7), square: v(8), flexibility: f(12), phase: f(13), frequency: f(14) };
  });
  return { count: branches.length, bend: (node, wind) => bend(node, branches, poses(info, branches, wind)) };
}

/** How each branch stands: parents come before their children. */
function poses({ steady, swings, rise, frequency }, branches, { strength, time }) {
  const all = [];
  for (const b of branches) {
    const own = { turn: new Quaternion(), base: b.base.clone() };
    if (b.parent !== 0xffffffff) {
      const parent = all[b.parent];
      own.turn.setFromAxisAngle(parent.axis, parent.angle * b.at).premultiply(parent.turn);
      own.base = place(branches[b.parent], parent, b.at, b.base);
    }
    const swing = ([far, fast, shift]) => far * Math.sin(2 * Math.PI * (time * frequency * b.frequency * fast + b.phase + shift));
    const [a, c, d, e] = swings.map(swing);
    const push = direction.clone().multiplyScalar(steady + a + c).addScaledVector(side, d + e).addScaledVector(up, rise * (d + e));
    push.multiplyScalar(strength * b.flexibility).applyQuaternion(own.turn.clone().invert());
    const along = b.linear.clone().add(b.square).normalize();
    push.addScaledVector(along, -push.dot(along));
    own.axis = along.cross(push).normalize();
    own.angle = 2 * push.length();
    all.push(own);
  }
  return all;
}

/** Where something is that rests at `p`, `s` along a branch: the line to there is summed up from its turned pieces. */
function place(branch, pose, s, p) {
  const line = (u) => branch.linear.clone().multiplyScalar(u).addScaledVector(branch.square, u * u);
  const moved = pose.base.clone();
  for (let i = 0; i < STEPS; i++) {
    const piece = line(s * (i + 1) / STEPS).sub(line(s * i / STEPS));
    moved.add(piece.applyAxisAngle(pose.axis, pose.angle * s * (i + 0.5) / STEPS).applyQuaternion(pose.turn));
  }
  const off = p.clone().sub(branch.base).sub(line(s)).applyAxisAngle(pose.axis, pose.angle * s);
  return moved.add(off.applyQuaternion(pose.turn));
}

function bend(node, branches, all) {
  node.traverse(({ geometry }) => {
    const on = geometry?.getAttribute('_wind_branch');
    if (!on) return;
    const position = geometry.getAttribute('position');
    for (let i = 0; i < position.count; i++) {
      const branch = on.getX(i);
      const p = new Vector3().fromBufferAttribute(position, i);
      position.setXYZ(i, ...place(branches[branch], all[branch], on.getY(i), p));
    }
    position.needsUpdate = true;
  });
}
