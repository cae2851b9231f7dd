/** The hall from above, on a canvas: grids, scan, plan, robots; goals and poses are set by click and drag. */

import { html, useLayoutEffect, useRef } from "ui";
import { isStale } from "./silence.js";
import { drawTasks } from "./tasks.js";
import { compose, place, poseOf, yawOf } from "./transforms.js";

const DRAG_PX = 8;
const LOW_PX = 420;
const KINDS = ["map", "zones", "global", "local"]; // from below

export class MapView {
  constructor(canvas, station) {
    this.canvas = canvas;
    this.station = station;
    this.scale = 40; // px per m
    this.centre = [0, 0];
    this.layers = {};
    this.tool = "pan";
    this._pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => this._down(event));
    canvas.addEventListener("pointermove", (event) => this._move(event));
    canvas.addEventListener("pointerup", (event) => this._up(event));
    canvas.addEventListener("pointercancel", (event) => this._pointers.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this._zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this._key(event));
  }

  fit() {
    const grid = this.station.robot?.grids.map;
    const { clientWidth: w, clientHeight: h } = this.canvas;
    if (!grid) return false;
    const { width, height, resolution, origin } = grid.info;
    const [top, bottom] = h < LOW_PX ? this._bars(h) : [0, h]; // there is little to see: none of it under buttons
    this.scale = Math.min(w / (width * resolution), (bottom - top) / (height * resolution)) * 0.94;
    this.centre = [origin.position.x + width * resolution / 2, origin.position.y + height * resolution / 2 + ((top + bottom - h) / 2) / this.scale];
    return true;
  }

  /** Between which heights no buttons lie over the map [px]. */
  _bars(h) {
    const [top, bottom] = ["top", "bottom"].map((side) => this.canvas.parentElement.querySelector(`.bar.${side}`));
    return [top ? top.offsetTop + top.offsetHeight : 0, bottom ? bottom.offsetTop : h];
  }

  zoom(by) {
    this._zoom(by, this.canvas.clientWidth / 2, this.canvas.clientHeight / 2);
  }

  world(x, y) {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return [this.centre[0] + (x - w / 2) / this.scale, this.centre[1] - (y - h / 2) / this.scale];
  }

  pixel([x, y]) {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return [w / 2 + (x - this.centre[0]) * this.scale, h / 2 - (y - this.centre[1]) * this.scale];
  }

  _zoom(by, x, y) {
    const before = this.world(x, y);
    this.scale = Math.min(400, Math.max(0.5, this.scale * by));
    const after = this.world(x, y);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]];
  }

  _key(event) {
    const step = 60 / this.scale;
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    if (moves[event.key]) this.centre = this.centre.map((value, i) => value + moves[event.key][i]);
    else if (event.key === "+" || event.key === "-") this.zoom(event.key === "+" ? 1.25 : 0.8);
    else return;
    this.onpan?.();
    event.preventDefault();
  }

  _down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this._pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (this.tool !== "pan" && this._pointers.size === 1) this.drag = { from: [event.offsetX, event.offsetY], to: [event.offsetX, event.offsetY] };
    else this.drag = null;
  }

  _move(event) {
    const before = this._pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    if (this.drag) this.drag.to = now;
    else if (this._pointers.size === 1) {
      this.centre = [this.centre[0] - (now[0] - before[0]) / this.scale, this.centre[1] + (now[1] - before[1]) / this.scale];
      this.onpan?.();
    } else {
      const other = [...this._pointers].find(([id]) => id !== event.pointerId)[1];
      const spread = (point) => Math.max(1, Math.hypot(point[0] - other[0], point[1] - other[1]));
      this._zoom(spread(now) / spread(before), other[0], other[1]);
    }
    this._pointers.set(event.pointerId, now);
  }

  _up(event) {
    this._pointers.delete(event.pointerId);
    if (!this.drag) return;
    const [x, y] = this.world(...this.drag.from);
    this.onset?.(x, y, this._heading());
    this.drag = null;
  }

  _heading() {
    const [dx, dy] = [this.drag.to[0] - this.drag.from[0], this.drag.from[1] - this.drag.to[1]];
    if (Math.hypot(dx, dy) > DRAG_PX) return Math.atan2(dy, dx);
    return this.station.robot ? yawOf(this.station.robot.pose.pose.q) : 0;
  }

  draw() {
    const { canvas, station } = this, ratio = window.devicePixelRatio || 1;
    const { clientWidth: w, clientHeight: h } = canvas;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio);
      canvas.height = Math.round(h * ratio);
    }
    const c = canvas.getContext("2d");
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(`--${name}`).trim();
    c.fillStyle = colour("map-unknown");
    c.fillRect(0, 0, w, h);
    const robot = station.robot;
    if (!robot) return;
    if (this.follow) this.centre = robot.pose.pose.p.slice(0, 2);
    const grids = Object.values(robot.grids).sort((a, b) => KINDS.indexOf(a.kind) - KINDS.indexOf(b.kind));
    for (const grid of grids)
      if (grid.kind === "map" || this.layers[grid.kind === "zones" ? "zones" : "costmap"]) this._grid(c, robot, grid);
    this._metres(c, w, h, colour);
    if (this.layers.scan && robot.scan) {
      c.fillStyle = colour("scan");
      for (const point of robot.scan.placed) {
        const [x, y] = this.pixel(point);
        c.fillRect(x - 1.25, y - 1.25, 2.5, 2.5);
      }
    }
    if (this.layers.plan && robot.plan?.poses.length) {
      c.strokeStyle = colour("plan");
      c.lineWidth = 2.5;
      this._line(c, robot.plan.poses.map(({ pose }) => [pose.position.x, pose.position.y]));
    }
    if (this.layers.zones) station.zones.draw(this, c, colour);
    this._things(c, robot.goods, 0.15, colour("goods"));
    this._things(c, robot.people, 0.25, colour("people"));
    drawTasks(c, this, robot, colour);
    station.queue.filter((goal) => goal.state === "active" || goal.state === "waiting").forEach((goal, i) => this._flag(c, [goal.x, goal.y], goal.yaw, colour("accent"), goal.state === "active" ? "" : String(i + 1)));
    for (const each of station.robots.values()) this._robot(c, each, each === robot, colour);
    if (this.drag) this._flag(c, this.world(...this.drag.from), this._heading(), colour(this.tool === "pose" ? "good" : "accent"), "");
  }

  _grid(c, robot, grid) {
    const pose = compose(robot.frames.lookup(grid.frame).pose, poseOf(grid.info.origin));
    c.save();
    c.translate(...this.pixel(pose.p));
    c.rotate(-yawOf(pose.q));
    grid.paint(c, this.scale * grid.info.resolution);
    c.restore();
  }

  /** A ruler in the corner. */
  _metres(c, w, h, colour) {
    const length = [0.5, 1, 2, 5, 10, 20, 50].find((metres) => metres * this.scale > 60) ?? 100;
    const left = w - 16 - length * this.scale, bar = this.canvas.parentElement.querySelector(".bar.bottom");
    if (bar && bar.offsetLeft + bar.offsetWidth > left - 12) h = bar.offsetTop; // above the buttons, not under them
    c.strokeStyle = c.fillStyle = colour("muted");
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(left, h - 20);
    c.lineTo(left, h - 14);
    c.lineTo(w - 16, h - 14);
    c.lineTo(w - 16, h - 20);
    c.stroke();
    c.font = "12px system-ui, sans-serif";
    c.textAlign = "center";
    c.fillText(`${length} m`, left + (length * this.scale) / 2, h - 20);
  }

  _line(c, points, close = false) {
    c.beginPath();
    points.forEach((point) => c.lineTo(...this.pixel(point)));
    if (close) c.closePath();
    c.stroke();
  }

  _things(c, seen, half, colour) {
    if (!seen) return;
    c.strokeStyle = colour;
    c.lineWidth = 2;
    for (const at of seen.placed)
      this._line(c, [[-half, -half], [half, -half], [half, half], [-half, half]].map((corner) => place(at, [...corner, 0])), true);
  }

  _flag(c, at, yaw, colour, text) {
    const [x, y] = this.pixel(at);
    c.strokeStyle = c.fillStyle = colour;
    c.lineWidth = 2.5;
    c.beginPath();
    c.arc(x, y, 9, 0, 2 * Math.PI);
    c.moveTo(x, y);
    const [tx, ty] = [x + 28 * Math.cos(yaw), y - 28 * Math.sin(yaw)];
    c.lineTo(tx, ty);
    c.stroke();
    c.beginPath();
    for (const turn of [0, 2.5, -2.5]) c.lineTo(tx + 7 * Math.cos(yaw + turn), ty - 7 * Math.sin(yaw + turn));
    c.fill();
    c.font = "bold 12px system-ui, sans-serif";
    c.textAlign = "center";
    if (text) c.fillText(text, x - 16, y - 8);
  }

  _robot(c, robot, selected, colour) {
    const { pose } = robot.pose;
    c.globalAlpha = isStale(this.station, robot) ? 0.4 : 1; // where it was
    const stopped = Boolean(robot.guard?.stoppedBy);
    c.strokeStyle = c.fillStyle = colour(stopped ? "bad" : selected ? "robot" : "muted");
    c.lineWidth = 2;
    if (robot.footprint) {
      const frame = robot.frames.lookup(robot.footprint.header.frame_id).pose;
      this._line(c, robot.footprint.polygon.points.map(({ x, y, z }) => place(frame, [x, y, z])), true);
    }
    const size = Math.max(0.22, 9 / this.scale);
    c.beginPath();
    [[1, 0], [-0.8, 0.7], [-0.4, 0], [-0.8, -0.7]].forEach(([x, y]) => c.lineTo(...this.pixel(place(pose, [x * size, y * size, 0]))));
    c.fill();
    if (this.station.robots.size > 1) {
      const [x, y] = this.pixel(pose.p);
      c.font = "12px system-ui, sans-serif";
      c.textAlign = "center";
      c.fillText(robot.name, x, y - 20);
    }
    c.globalAlpha = 1;
  }
}

/** The canvas as a component; `hold` is given the view. */
export function MapCanvas({ station, tool, layers, follow, label, hold, onset, onpan }) {
  const canvas = useRef(), view = useRef();
  useLayoutEffect(() => {
    view.current = new MapView(canvas.current, station);
    hold(view.current);
    let frame, fitted = false;
    const loop = () => {
      if (!fitted) fitted = view.current.fit();
      view.current.draw();
      frame = requestAnimationFrame(loop);
    };
    loop();
    return () => cancelAnimationFrame(frame);
  }, []);
  useLayoutEffect(() => void Object.assign(view.current, { tool, layers, follow, onset, onpan }));
  return html`<canvas ref=${canvas} class="map tool-${tool}" tabindex="0" role="img" aria-label=${label}></canvas>`;
}
