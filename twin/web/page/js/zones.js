/** Keep-out zones: drawn on the map or typed, kept by the robot's vector_object_server, as in Nav2. */

import { html, useEffect, useReducer, useState } from "ui";

const LOOK_MS = 3000;
const SERVER = "vector_object_server", TYPES = "nav2_msgs/srv/";
const KEEPOUT = 100;

const side = ([ax, ay], [bx, by], [cx, cy]) => (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);

/** Whether two edges of a polygon that are no neighbours cross. */
function crosses(corners) {
  const count = corners.length, edge = (i) => [corners[i], corners[(i + 1) % count]];
  return corners.some((_, i) => corners.some((__, j) => {
    if (j < i + 2 || (j + 1) % count === i) return false;
    const [a, b] = edge(i), [c, d] = edge(j);
    return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
  }));
}

/** Corners as they are typed: an x and a y in each line. */
function read(text) {
  return text.split("\n").filter((line) => line.trim()).map((line) => line.trim().split(/[\s,;]+/).map(Number));
}

const write = (corners) => corners.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("\n");

export class Zones extends EventTarget {
  constructor(station) {
    super();
    this.station = station;
    this.draft = ""; // as it is typed; what is drawn is written there, too
    this.fault = ""; // a word of the page, or a sentence of the server
    this.shapes = []; // {uuid, corners}
    setInterval(() => this.look(), LOOK_MS);
    station.ros.addEventListener("connection", () => this.look());
  }

  changed() {
    this.dispatchEvent(new Event("change"));
  }

  /** Corners of the draft that are numbers. */
  get corners() {
    return read(this.draft).filter((corner) => corner.length === 2 && corner.every(Number.isFinite));
  }

  get service() {
    const name = `${this.station.robot?.space ?? ""}/${SERVER}`;
    return this.station.services?.has(`${name}/add_shapes`) ? name : "";
  }

  type(text) {
    Object.assign(this, { draft: text, fault: "" });
    this.changed();
  }

  click(x, y) {
    this.type(write([...this.corners, [x, y]]));
  }

  undo() {
    this.type(write(this.corners.slice(0, -1)));
  }

  async look() {
    if (!this.service || !this.station.ros.connected) return;
    try {
      const { polygons, circles } = await this.station.ros.call(`${this.service}/get_shapes`, `${TYPES}GetShapes`);
      const round = circles.map(({ uuid, center, radius }) => ({ uuid: uuid.uuid, corners: Array.from({ length: 24 }, (_, i) => [center.x + radius * Math.cos(i * Math.PI / 12), center.y + radius * Math.sin(i * Math.PI / 12)]) }));
      this.shapes = [...polygons.map(({ uuid, points }) => ({ uuid: uuid.uuid, corners: points.map(({ x, y }) => [x, y]) })), ...round];
      this.changed();
    } catch { /* no connection: it is looked again */ }
  }

  /** Give the draft to the robot; returns whether it has taken it. */
  async add() {
    const corners = read(this.draft);
    this.fault = corners.length < 3 ? "zoneFew" : corners.length !== this.corners.length ? "zoneNumbers" : crosses(corners) ? "zoneCrosses" : "";
    const points = corners.map(([x, y]) => ({ x, y, z: 0 })), header = { frame_id: this.station.robot.pose.root };
    const done = !this.fault && (await this._call("add_shapes", "AddShapes", { polygons: [{ header, points, closed: true, value: KEEPOUT }] }));
    if (done) this.draft = "";
    this.changed();
    return done;
  }

  remove(uuid) {
    return this._call("remove_shapes", "RemoveShapes", { all_objects: false, uuids: [{ uuid }] });
  }

  async _call(name, type, args) {
    try {
      const { success } = await this.station.ros.call(`${this.service}/${name}`, `${TYPES}${type}`, args);
      this.fault = success ? "" : "zoneRefused";
    } catch (error) {
      this.fault = error.message;
    }
    await this.look();
    this.changed();
    return !this.fault;
  }

  draw(view, c, colour) {
    c.strokeStyle = c.fillStyle = colour("zone");
    c.lineWidth = 2;
    this.shapes.forEach(({ corners }, i) => {
      view._line(c, corners, true);
      c.font = "bold 12px system-ui, sans-serif";
      c.textAlign = "center";
      c.fillText(i + 1, ...view.pixel(middle(corners)));
    });
    if (!this.corners.length) return;
    c.setLineDash([6, 5]);
    view._line(c, this.corners, true);
    c.setLineDash([]);
    for (const corner of this.corners) {
      const [x, y] = view.pixel(corner);
      c.fillRect(x - 4, y - 4, 8, 8);
    }
  }
}

const middle = (corners) => [0, 1].map((axis) => corners.reduce((sum, corner) => sum + corner[axis], 0) / corners.length);

function useZones(station) {
  const [, refresh] = useReducer((count) => count + 1, 0);
  useEffect(() => {
    station.zones.look();
    station.zones.addEventListener("change", refresh);
    return () => station.zones.removeEventListener("change", refresh);
  }, []);
  return station.zones;
}

const Fault = ({ zones, t }) => zones.fault && html`<p class="bad" role="alert">${t(zones.fault)}</p>`;

/** What stands over the map while a zone is drawn. */
export function ZoneBar({ station, t, done }) {
  const zones = useZones(station);
  const add = async () => (await zones.add()) && done();
  return html`<div class="hint"><p role="status">${t("hintZone")}</p><${Fault} zones=${zones} t=${t} />
    <div class="row"><button id="zone-add" class="primary" disabled=${!zones.corners.length} onClick=${add}>${t("zoneAdd")}</button>
      <button disabled=${!zones.corners.length} onClick=${() => zones.undo()}>${t("zoneUndo")}</button></div></div>`;
}

/** The panel: zones that there are, and one that is typed. */
export function ZonesPanel({ station, t }) {
  const zones = useZones(station), [asked, ask] = useState("");
  if (!zones.service) return html`<p class="muted">${t("noZones")}</p>`;
  const add = (event) => {
    event.preventDefault();
    zones.add();
  };
  const remove = (uuid) => (asked === uuid ? zones.remove(uuid) : ask(uuid));
  return html`
    ${zones.shapes.length ? html`<ol class="list" id="zone-list">${zones.shapes.map(({ uuid, corners }, i) => html`<li key=${uuid}><b>${i + 1}</b>
      <span class="grow">${middle(corners).map((value) => value.toFixed(1)).join(", ")} m · ${corners.length} ${t("zoneCorners")}</span>
      <button aria-label=${`${t("zoneRemove")} ${i + 1}`} onClick=${() => remove(uuid)} hidden=${station.watches}>${t(asked === uuid ? "zoneSure" : "zoneRemove")}</button></li>`)}</ol>` : html`<p class="muted">${t("zoneNone")}</p>`}
    ${!station.watches && html`<form onSubmit=${add}><label class="small">${t("zoneLabel")}
      <textarea id="zone-draft" rows="5" value=${zones.draft} onInput=${(event) => zones.type(event.target.value)}></textarea></label>
      <${Fault} zones=${zones} t=${t} /><button class="primary">${t("zoneAdd")}</button></form>`}`;
}
