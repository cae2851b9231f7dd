/** Poses in three dimensions, and a tree of frames. A pose is {p: [x, y, z] in m, q: [x, y, z, w]}. */

export const IDENTITY = { p: [0, 0, 0], q: [0, 0, 0, 1] };

export function rotate([x, y, z, w], [a, b, c]) {
  const u = 2 * (y * c - z * b), v = 2 * (z * a - x * c), t = 2 * (x * b - y * a);
  return [a + w * u + y * t - z * v, b + w * v + z * u - x * t, c + w * t + x * v - y * u];
}

function multiply([x, y, z, w], [a, b, c, d]) {
  return [
    w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a,
    w * c + x * b - y * a + z * d, w * d - x * a - y * b - z * c,
  ];
}

/** Return where a point of a pose's frame is in the frame of the pose. */
export function place({ p, q }, point) {
  const [x, y, z] = rotate(q, point);
  return [p[0] + x, p[1] + y, p[2] + z];
}

export function compose(outer, inner) {
  return { p: place(outer, inner.p), q: multiply(outer.q, inner.q) };
}

export function yawOf([x, y, z, w]) {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

export function quaternionOf(yaw) {
  return { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) };
}

/** Return a pose of a geometry_msgs/Pose or Transform. */
export function poseOf({ position, translation = position, orientation, rotation = orientation }) {
  return { p: [translation.x, translation.y, translation.z], q: [rotation.x, rotation.y, rotation.z, rotation.w] };
}

const PAST_S = 11; // transforms that are kept: after a jump in a bag ten seconds of them come
const NEAR_S = 1; // a transform so much later than what it places is still good for it

const seconds = ({ sec, nanosec }) => sec + nanosec * 1e-9;

export class Frames {
  constructor() {
    this._parents = new Map(); // child -> {parent, pose, time}
    this._past = new Map(); // child -> the same, the oldest first; not of what never moves
  }

  take(message, isStatic = false) {
    for (const { child_frame_id: child, header, transform } of message.transforms) {
      const link = { parent: header.frame_id, pose: poseOf(transform), time: seconds(header.stamp) };
      this._parents.set(child, link);
      if (isStatic) this._past.delete(child);
      else this._remember(child, link);
    }
  }

  _remember(child, link) {
    const past = this._past.get(child) ?? [];
    if (past.length && past.at(-1).time > link.time) past.length = 0; // time begins anew
    past.push(link);
    if (past[0].time < link.time - 2 * PAST_S) past.splice(0, past.findIndex(({ time }) => time >= link.time - PAST_S)); // now and then
    this._past.set(child, past);
  }

  /** Return {root, pose}: the frame at the tree's root and where `frame` is in it. */
  lookup(frame) {
    return this._climb(frame, (child) => this._parents.get(child));
  }

  /** The same at the time of a stamp; null if it is not known where the frame was then. */
  at(frame, stamp) {
    const time = seconds(stamp);
    return this._climb(frame, (child) => {
      const past = this._past.get(child);
      if (!past) return this._parents.get(child);
      return past.findLast((link) => link.time <= time) ?? (past[0].time - time < NEAR_S ? past[0] : null);
    });
  }

  _climb(frame, linkOf) {
    let pose = IDENTITY, root = frame;
    for (let depth = 0; depth < 64 && this._parents.has(root); depth++) {
      const link = linkOf(root);
      if (!link) return null;
      pose = compose(link.pose, pose);
      root = link.parent;
    }
    return { root, pose };
  }
}
