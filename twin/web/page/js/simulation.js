/** A simulation's time: pause, steps, speed, and its beginning anew; shown only where there is one. */

import { html, useRef } from "ui";

const PLAYING = 1, PAUSED = 2;
const OK = 1, ALREADY = 101;
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 0];
const SERVICES = "simulation_interfaces/srv";

async function ask(station, service, type, args = {}) {
  try {
    const { result, success, message } = await station.ros.call(service, type, args);
    const why = result ? ([OK, ALREADY].includes(result.result) ? "" : result.error_message) : success ? "" : message;
    if (why) station.note("warn", "simulation", why);
  } catch (error) {
    station.note("warn", "simulation", error.message);
    station.refuse(error.message);
  }
}

/** Whether time stands because somebody said so. */
export const stands = (station) => Boolean(station.simulation) && station.simulation.state.state !== PLAYING;

export function Simulation({ station, t }) {
  const dialog = useRef(), { simulation } = station;
  if (!simulation) return null;
  const paused = stands(station), speeds = SPEEDS.includes(simulation.speed) ? SPEEDS : [simulation.speed, ...SPEEDS];
  const set = (state) => ask(station, "/set_simulation_state", `${SERVICES}/SetSimulationState`, { state: { state } });
  const reset = () => { ask(station, "/reset_simulation", `${SERVICES}/ResetSimulation`); dialog.current.close(); };
  return html`<section class="card row simulation" aria-label=${t("simulation")}>
    <button id="simulation-play" class=${paused ? "primary" : ""} onClick=${() => set(paused ? PLAYING : PAUSED)}>${t(paused ? "play" : "pause")}</button>
    <button id="simulation-step" disabled=${!paused} onClick=${() => ask(station, "/step_simulation", `${SERVICES}/StepSimulation`, { steps: 1 })}>${t("step")}</button>
    <select id="simulation-speed" aria-label=${t("pace")} value=${simulation.speed} onChange=${(event) => ask(station, "/simulation/set_speed", "twin_msgs/srv/SetSpeed", { speed: Number(event.target.value) })}>
      ${speeds.map((speed) => html`<option value=${speed}>${speed ? `${speed}×` : t("fastest")}</option>`)}</select>
    <span class="grow"></span>
    <button id="simulation-reset" onClick=${() => dialog.current.showModal()}>${t("reset")}</button>
    <dialog ref=${dialog} aria-labelledby="reset-title">
      <h2 id="reset-title">${t("resetAsk")}</h2>
      <p>${t("resetText")}</p>
      <div class="row end"><button onClick=${() => dialog.current.close()}>${t("cancel")}</button><button id="reset-confirm" class="primary" onClick=${reset}>${t("reset")}</button></div>
    </dialog></section>`;
}
