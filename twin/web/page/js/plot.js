/** A plot over time of any number in any topic. */

import { html, useEffect, useRef, useState } from "ui";
import uPlot from "uplot";

const HEIGHT = 240; // px
const WINDOW = 600; // samples
const EVERY_S = 0.05; // between two samples, at least
const ELEMENTS = 12; // of an array, that are offered

/** Return the paths of numbers in a message. */
function numbers(value, path = "", depth = 0) {
  if (typeof value === "number") return [path];
  if (value === null || typeof value !== "object" || depth > 6) return [];
  const entries = Array.isArray(value) ? value.slice(0, ELEMENTS).map((each, i) => [i, each]) : Object.entries(value);
  return entries.flatMap(([key, each]) => numbers(each, path ? `${path}.${key}` : String(key), depth + 1));
}

/** The time now [s]: of the simulation or the bag if there is one. */
function timeOf({ time, at, factor }) {
  const now = performance.now() / 1000;
  return time === null ? now : time + (factor ?? 1) * (now - at);
}

export function Plot({ station, t, theme }) {
  const [topic, setTopic] = useState(""), [field, setField] = useState(""), [fields, setFields] = useState([]);
  const box = useRef(), chart = useRef(), last = useRef(), samples = useRef([[], []]), chosen = useRef("");
  const jumps = station.history?.jumps;
  chosen.current = field;
  const restart = () => {
    const begun = (samples.current = [[], []]);
    chart.current?.setData(begun);
    if (!station.history || !field) return;
    const asked = { topic, field, seconds: WINDOW * EVERY_S, every: EVERY_S };
    station.ros.call("/twin/past_values", "twin_msgs/srv/PastValues", asked).then(({ times, values }) => {
      if (samples.current !== begun) return; // something else was chosen meanwhile
      const before = times.filter((time) => !(time >= begun[0][0]));
      chart.current?.setData((samples.current = [[...before, ...begun[0]], [...values.slice(0, before.length), ...begun[1]]]));
    }).catch(() => {}); // who may not ask sees what comes from now on
  };
  const draw = () => {
    if (!chosen.current || !last.current) return;
    const [x, y] = samples.current, now = timeOf(station.clock);
    x.push(Math.max(now, x.at(-1) ?? now)); // its estimate may go back a little
    y.push(chosen.current.split(".").reduce((part, key) => part?.[key], last.current) ?? null);
    while (x.length > WINDOW) x.shift(), y.shift();
    chart.current.setData(samples.current);
  };
  useEffect(() => {
    if (!topic) return undefined;
    const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(`--${name}`).trim();
    const axis = { stroke: colour("muted"), grid: { stroke: colour("line") } };
    chart.current = new uPlot({
      width: box.current.clientWidth, height: HEIGHT, scales: { x: { time: false } }, axes: [axis, axis],
      series: [{ label: "s" }, { label: t("field"), stroke: colour("accent"), width: 2 }],
    }, samples.current, box.current);
    const turned = new ResizeObserver(() => box.current && chart.current.setSize({ width: box.current.clientWidth, height: HEIGHT }));
    turned.observe(box.current);
    return () => { turned.disconnect(); chart.current.destroy(); };
  }, [topic, theme, t("field")]); // in another theme or language the same again
  useEffect(() => {
    setField("");
    setFields([]);
    last.current = undefined;
    if (!topic) return undefined;
    let known = false;
    return station.ros.subscribe(topic, station.types.get(topic), (message) => {
      if (!known) setFields(numbers(message));
      known = true;
      last.current = message;
      draw();
    }, 1000 * EVERY_S);
  }, [topic]);
  useEffect(restart, [topic, field, jumps]); // what was at another time in the bag is over
  useEffect(draw, [field]); // a bag that is paused says no more
  const select = (label, value, all, change) => html`<label class="small">${label}<select value=${value} onChange=${(event) => change(event.target.value)}>
    <option value="">${t("choose")}</option>${all.map((each) => html`<option value=${each}>${each}</option>`)}</select></label>`;
  return html`${select(t("topic"), topic, [...station.types.keys()].sort(), setTopic)} ${select(t("field"), field, fields, setField)}<div ref=${box} class="plot"></div>`;
}
