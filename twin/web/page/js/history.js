/** Time in a bag: where it stands, how fast it goes, and a slider through it. */

import { html, useEffect, useRef, useState } from "ui";

const SERVICE = "/rosbag2_player", TYPES = "rosbag2_interfaces/srv/";
const RATES = [0.25, 0.5, 1, 2, 4, 8, 16];
const STEP_S = 0.1;
const SEEK_MS = 150; // while the slider is drawn

export const HISTORY = "twin_msgs/msg/History";

const seconds = ({ sec, nanosec }) => sec + nanosec * 1e-9;

function clock(time) {
  const whole = Math.floor(time);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}.${Math.floor((time - whole) * 10)}`;
}

/** Take a twin_msgs/History; after a jump what the page knew is over. */
export function takeHistory(station, message) {
  const before = station.history;
  station.history = message;
  station.clock = { time: seconds(message.now), at: performance.now() / 1000, factor: message.paused ? 0 : message.rate };
  if (before && before.jumps !== message.jumps) station.forget();
}

export function HistoryBar({ station, t }) {
  const [held, hold] = useState(null), asked = useRef(0), state = station.history;
  useEffect(() => hold(null), [state?.jumps]);
  if (!state) return null;
  const start = seconds(state.start), length = seconds(state.end) - start, now = held ?? seconds(state.now) - start;
  const call = (name, type, args = {}) => station.ros.call(`${SERVICE}/${name}`, `${TYPES}${type}`, args).catch((error) => station.note("warn", "history", error.message));
  const seek = (to) => {
    const time = Math.min(Math.max(to, 0), length) + start, sec = Math.floor(time);
    const { sec: lastSec, nanosec: lastPart } = state.end, nanosec = Math.round((time - sec) * 1e9);
    const isAfter = sec > lastSec || (sec === lastSec && nanosec > lastPart); // rounded over the end
    call("seek", "Seek", { time: isAfter ? state.end : { sec, nanosec } });
  };
  const slide = (event) => {
    const to = Number(event.target.value);
    hold(to);
    clearTimeout(asked.current);
    asked.current = setTimeout(() => seek(to), SEEK_MS);
  };
  const day = start > 1e8 && new Date((start + now) * 1000).toLocaleString(document.documentElement.lang);
  return html`<section class="history" aria-label=${t("past")}>
    <strong class="badge">${t("past")}</strong>
    <button id="play" class="icon" aria-label=${t(state.paused ? "playBag" : "pauseBag")} onClick=${() => call(state.paused ? "resume" : "pause", state.paused ? "Resume" : "Pause")}>${state.paused ? "▶" : "❚❚"}</button>
    <input id="time" type="range" min="0" max=${length} step=${STEP_S} value=${now} aria-label=${t("pastTime")} aria-valuetext=${`${clock(now)} / ${clock(length)}`} onInput=${slide} />
    <output id="past-now">${clock(now)} / ${clock(length)}${day && html` <span class="muted wide">${day}</span>`}</output>
    <select id="rate" aria-label=${t("pace")} value=${state.rate} onChange=${(event) => call("set_rate", "SetRate", { rate: Number(event.target.value) })}>
      ${[...new Set([...RATES, state.rate])].sort((a, b) => a - b).map((rate) => html`<option value=${rate}>${rate}×</option>`)}</select>
  </section>`;
}

/** The mission's steps up to now. */
export function Mission({ station, t }) {
  const steps = station.robot?.mission ?? [];
  return steps.length ? html`<ol class="steps">${steps.slice(-30).map((step, i, all) => html`<li class=${i === all.length - 1 ? "now" : ""}>${step.state}</li>`)}</ol>` : html`<p class="muted">${t("noMission")}</p>`;
}
