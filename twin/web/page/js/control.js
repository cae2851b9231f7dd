/** Who steers, and who this is: the page keeps control for as long as its operator wants it and looks at it. */

import { html } from "ui";

const SERVICE = "/twin/control", TYPE = "twin_msgs/srv/Control";
const RENEWALS = 3; // in the time that control lasts
const LEASE_MS = 3000; // until the server has told of its own
const LEAST_MS = 300;

export class Control {
  /** @param {string} name that its operator goes by; empty: as the server calls the token */
  constructor(station, name) {
    this.station = station;
    this.name = name;
    this.state = null; // twin_msgs/Control, once the server has told; `own` id and `role`
    this.wanted = false;
    this.lease = LEASE_MS;
    station.ros.addEventListener("connection", () => this._connection());
    this._renew();
  }

  get mine() {
    return Boolean(this.state?.holder) && this.state.holder_id === this.state.own;
  }

  /** Whether this page may only look; a server without roles lets it do all. */
  get watches() {
    return this.state?.role === "viewer";
  }

  /** Who stops and releases, for others to read. */
  get signature() {
    return this.name || (this.mine && this.state.holder) || this.state?.role || "operator's page";
  }

  /** Take a twin_msgs/Control; tell if control is over that was wanted. */
  told(message) {
    const had = this.mine;
    this.state = { ...this.state, ...message };
    if (had && !this.mine && this.wanted) {
      this.wanted = false;
      const { holder } = this.state;
      this.station.tell((t) => (holder ? `${holder} ${t("controlTaken")}` : t("controlOver")));
    }
  }

  /** Take, take over or release control, or with an empty command ask who has it. */
  async ask(command, { quiet = false } = {}) {
    if (command === "release") this.wanted = false;
    try {
      const { id, success, message, ...rest } = await this.station.ros.call(SERVICE, TYPE, { command, name: this.name });
      this.told({ ...rest, own: id });
      if (command) this.wanted = success && command !== "release";
      if (command && success && this.mine) this.lease = rest.remaining * 1000;
      if (command && !success && !quiet) this.station.refuse(message);
    } catch (error) {
      this.station.note("warn", "control", error.message);
    }
    this.station.changed();
  }

  /** Go by another name. */
  rename(name) {
    this.name = name;
    if (this.mine) this.ask("take");
    this.station.changed();
  }

  _connection() {
    if (this.station.ros.connected) this.ask("");
    else Object.assign(this, { wanted: false, state: null });
  }

  /** Renew control, also while a goal of this page is under way. Who hides the page, or lets it sleep, loses it: nobody looks. */
  async _renew() {
    if (this.mine && !document.hidden && (this.wanted || this.station.hasGoal)) {
      const { wanted } = this;
      await this.ask("take", { quiet: true });
      this.wanted &&= wanted; // a goal's control ends with it
    }
    setTimeout(() => this._renew(), Math.max(LEAST_MS, this.lease / RENEWALS));
  }
}

export function ControlBar({ station, t, edit }) {
  const { control } = station, { state, mine } = control;
  if (!state || station.history) return null;
  const words = mine ? t("controlMine") : state.holder ? `${state.holder} ${t("controlOther")}` : t("controlNone");
  const command = mine ? "release" : state.holder ? "take_over" : "take";
  return html`<div class="control"><span class=${mine ? "good" : ""}>${words}</span>
    ${control.watches ? html`<span class="badge">${t("watching")}</span>` : html`<button onClick=${() => control.ask(command)}>${t(mine ? "giveBack" : state.holder ? "takeOver" : "take")}</button>
    <button class="plain icon" aria-label=${t("who")} title=${`${t("who")}: ${control.name || "–"}`} onClick=${edit}><svg viewBox="0 0 20 20" width="18" height="18" fill="currentColor" aria-hidden="true"><circle cx="10" cy="6" r="4" /><path d="M2 19a8 8 0 0 1 16 0z" /></svg></button>`}</div>`;
}
