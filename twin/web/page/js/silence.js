/** Whether robots still speak: each by its odometry, as that is what its place and speed on the page come from. */

import { stands } from "./simulation.js";

const LOOK_MS = 500;
const SILENT_S = 2, MISSED = 5; // so many of its usual messages, if they are rarer
const LATE_MS = 2000; // a page that slept has not heard what was said meanwhile

/** When a robot spoke last. */
export class Pulse {
  constructor() {
    this.heard = this.since = performance.now(); // since: from when silence counts
    this.time = new Date(); // of the last message, for people
    this.period = 0; // [s]
    this.silent = false;
  }

  beat() {
    const gap = Math.min(this.age, 2 * SILENT_S);
    this.period = this.period ? 0.9 * this.period + 0.1 * gap : gap;
    this.heard = performance.now();
    this.time = new Date();
    this.silent = false;
  }

  /** Time since the last message [s]. */
  get age() {
    return (performance.now() - this.heard) / 1000;
  }

  /** Silence does not count now. */
  hold() {
    if (!this.silent) this.since = performance.now();
  }

  check(speed) {
    const quiet = (performance.now() - Math.max(this.heard, this.since)) / 1000;
    if (quiet > Math.max(SILENT_S, MISSED * this.period) / speed) this.silent = true;
  }
}

/** What the page shows of a robot may be over: it is silent, or nobody is connected. */
export const isStale = (station, robot) => !station.history && (!station.ros.connected || robot.pulse.silent);

/** Raise an alarm for each robot that falls silent, until it speaks again. */
export function watchSilence(station) {
  let looked = performance.now();
  setInterval(() => {
    const now = performance.now(), slept = now - looked > LATE_MS;
    looked = now;
    for (const robot of station.robots.values()) {
      if (slept || !station.ros.connected || station.history || stands(station)) robot.pulse.hold();
      else robot.pulse.check(Math.min(1, station.simulation?.speed || 1));
      const since = robot.pulse.time.toLocaleTimeString("en-GB"); // while it lasts the text stays, so that it is one alarm
      station.alarm(`silent ${robot.space}`, "error", (t) => `${robot.name}: ${t("silentSince")} ${since}`, { active: robot.pulse.silent });
    }
  }, LOOK_MS);
}
