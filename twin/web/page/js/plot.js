/** A plot over time of any number in any topic. */

import { html, useEffect, useRef, useState } from "ui";
import uPlot from "uplot";

const WINDOW = 600; // samples
const ELEMENTS = 12; // of an array, that are offered

/** Return the paths of numbers in a message. */
function numbers(value, path = "", depth = 0) {
  if (typeof value === "number") return [path];
  if (value === null || typeof value !== "object" || depth > 6) return [];
  const entries = Array.isArray(value) ? value.slice(0, ELEMENTS).map((each, i) => [i, each]) : Object.entries(value);
  return entries.flatMap(([key, each]) => numbers(each, path ? `${path}.${key}` : String(key), depth + 1));
}

export function Plot({ station, t }) {
  const [topic, setTopic] = useState(""), [field, setField] = useState(""), [fields, setFields] = useState([]);
  const box = useRef(), chosen = useRef("");
  chosen.current = field;
  useEffect(() => {
    setField("");
    setFields([]);
    if (!topic) return undefined;
    let known = false;
    const samples = { field: "", x: [], y: [] };
    const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(`--${name}`).trim();
    const axis = { stroke: colour("muted"), grid: { stroke: colour("line") } };
    const chart = new uPlot({
      width: box.current.clientWidth, height: 240, scales: { x: { time: false } }, axes: [axis, axis],
      series: [{ label: "s" }, { label: t("field"), stroke: colour("accent"), width: 2 }],
    }, [[], []], box.current);
    const end = station.ros.subscribe(topic, station.types.get(topic), (message) => {
      if (!known) setFields(numbers(message));
      known = true;
      if (!chosen.current) return;
      if (samples.field !== chosen.current) Object.assign(samples, { field: chosen.current, x: [], y: [] });
      const value = chosen.current.split(".").reduce((part, key) => part?.[key], message);
      samples.x.push(station.clock.time === null ? performance.now() / 1000 : station.clock.time + performance.now() / 1000 - station.clock.at);
      samples.y.push(value ?? null);
      if (samples.x.length > WINDOW) samples.x.shift(), samples.y.shift();
      chart.setData([samples.x, samples.y]);
    }, 50);
    return () => { end(); chart.destroy(); };
  }, [topic]);
  const select = (label, value, all, change) => html`<label class="small">${label}<select value=${value} onChange=${(event) => change(event.target.value)}>
    <option value="">${t("choose")}</option>${all.map((each) => html`<option value=${each}>${each}</option>`)}</select></label>`;
  return html`${select(t("topic"), topic, [...station.types.keys()].sort(), setTopic)} ${select(t("field"), field, fields, setField)}<div ref=${box} class="plot"></div>`;
}
