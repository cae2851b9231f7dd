/** The operator's page: what stands where. */

import { html, render, useEffect, useLayoutEffect, useReducer, useRef, useState } from "ui";
import { said } from "./alarms.js";
import { ZoneBar, Zones, ZonesPanel } from "./zones.js";
import { Camera } from "./camera.js";
import { ControlBar } from "./control.js";
import { Drive } from "./drive.js";
import { NameDialog, Notice, TokenForm } from "./entry.js";
import { HistoryBar, Mission } from "./history.js";
import { MapCanvas } from "./map.js";
import { Rosbridge } from "./rosbridge.js";
import { isStale } from "./silence.js";
import { Simulation, stands } from "./simulation.js";
import { Station } from "./station.js";
import { Tasks } from "./tasks.js";
import { yawOf } from "./transforms.js";
import { clock, wordsOf } from "./words.js";

const SILENT_S = 2;
const kept = (key, otherwise) => localStorage.getItem(`twin.${key}`) ?? otherwise;
const keep = (key, value) => localStorage.setItem(`twin.${key}`, value);

function EmergencyStop({ station, t }) {
  const dialog = useRef();
  const stopped = station.stopped, robots = [...station.robots.values()];
  const asked = robots.some((robot) => robot.stopAsked);
  if (!stopped.length)
    return html`<button id="stop" class="stop ${station.ros.connected ? "" : "unheard"}" onClick=${() => station.stop()} disabled=${!robots.some((robot) => robot.guard && !robot.stopRefused)}
      title=${robots.some((robot) => robot.stopRefused) ? t("refusedRole") : robots.some((robot) => robot.guard) ? t("stop") : t("noStop")}>${asked ? t("stopping") : t("stopShort")}</button>`;
  if (station.watches) return null; // who only looks reads it in the banner
  return html`
    <button id="release" class="stop latched" onClick=${() => dialog.current.showModal()} aria-label=${t("release")}>${t("release")}</button>
    <dialog ref=${dialog} aria-labelledby="release-title">
      <h2 id="release-title">${t("releaseAsk")}</h2>
      <p>${stopped.map((robot) => html`${robot.name}: ${t("stopped")} ${robot.guard.stoppedBy}<br />`)}</p>
      <p>${t("releaseText")}</p>
      <div class="row end">
        <button onClick=${() => dialog.current.close()}>${t("cancel")}</button>
        <button id="release-confirm" class="primary" onClick=${() => { station.release(); dialog.current.close(); }}>${t("release")}</button>
      </div>
    </dialog>`;
}

/** How it goes, in a colour and a few words: the worst first. */
function lampOf(station, t) {
  const { ros } = station, age = (performance.now() - ros.heard) / 1000;
  const silent = [...station.robots.values()].find((robot) => robot.pulse.silent);
  if (!ros.connected) return ["bad", t(ros.refused ? "tokenAsked" : "disconnected")];
  if (silent) return ["bad", `${silent.name}: ${t("silent")} ${silent.pulse.age.toFixed(0)} s`];
  if (stands(station)) return ["warn", t("paused")];
  return age > SILENT_S ? ["warn", `${t("silent")} ${age.toFixed(0)} s`] : ["good", t("connected")];
}

/** Whether the page is as narrow as on a telephone held upright: then the header has room for little more than STOP. */
function useNarrow() {
  const query = useRef(matchMedia("(max-width: 900px) and (orientation: portrait), (max-width: 600px)")).current, [narrow, setNarrow] = useState(query.matches);
  useEffect(() => {
    const look = () => setNarrow(query.matches);
    query.addEventListener("change", look);
    return () => query.removeEventListener("change", look);
  }, []);
  return narrow;
}

function Figures({ station, t }) {
  const { time, factor, at } = station.clock;
  const still = !station.history && performance.now() / 1000 - at > SILENT_S; // no time has come
  return html`<dl class="figures ${still ? "stale" : ""}"><div><dt>${t("time")}</dt><dd>${clock(time)}</dd></div>
    <div><dt>${t("pace")}</dt><dd>${factor === null || still ? "–" : `${factor.toFixed(1)}×`}</dd></div></dl>`;
}

function Display({ t, theme, setTheme, language, setLanguage }) {
  return html`<button class="plain" id="language" lang=${language === "en" ? "zh" : "en"} onClick=${() => setLanguage(language === "en" ? "zh" : "en")}>${t("language")}</button>
    <button class="plain" id="theme" aria-label=${t("theme")} title=${t("theme")} onClick=${() => setTheme(theme === "dark" ? "light" : "dark")}>${theme === "dark" ? "☀" : "☾"}</button>`;
}

function Header({ narrow, editName, ...props }) {
  const { station, t } = props, [colour, words] = lampOf(station, t);
  return html`
    <header>
      <div class="brand"><img src="icon.svg" alt="" width="28" height="28" /><h1>${t("title")}</h1>
        ${station.robot?.label && html`<span class="badge">${station.robot.label}</span>`}</div>
      <div class="lamp ${colour}" role="status"><span class="dot"></span><span class="lamp-words">${words}</span></div>
      ${!narrow && html`<${Figures} ...${props} />`}
      ${station.robots.size > 1 && html`<select aria-label=${t("robot")} value=${station.selected} onChange=${(event) => station.select(event.target.value)}>
        ${[...station.robots.values()].map((robot) => html`<option value=${robot.space}>${robot.name}</option>`)}</select>`}
      <span class="grow"></span>
      <div class="wide"><${ControlBar} station=${station} t=${t} edit=${editName} /></div>
      ${!narrow && html`<${Display} ...${props} />`}
      ${!station.history && html`<${EmergencyStop} station=${station} t=${t} />`}
    </header>`;
}

function Banner({ station, t }) {
  const lost = !station.history && station.alarms.get("connection")?.active, by = new Map();
  for (const { name, guard } of station.stopped) by.set(guard.stoppedBy, [...(by.get(guard.stoppedBy) ?? []), name]);
  if (!by.size && !lost) return null;
  return html`<div class="banner" role="alert">${lost && html`<p id="lost">${t("unreached")}</p>`}
    ${[...by].map(([who, names]) => html`<p>${t("stop")}: ${names.join(", ")} – ${t("stopped")} ${who}</p>`)}</div>`;
}

function RobotCard({ station, t }) {
  const robot = station.robot;
  if (!robot) return html`<section class="card"><p class="muted">${t("waiting")}</p></section>`;
  const { p, q } = robot.pose.pose, charge = robot.battery?.percentage;
  const figures = [
    [t("speed"), `${robot.velocity.linear.toFixed(2)} m/s`], [t("turn"), `${robot.velocity.angular.toFixed(2)} rad/s`],
    [t("position"), `${p[0].toFixed(2)}, ${p[1].toFixed(2)} m · ${Math.round(yawOf(q) * 180 / Math.PI)}°`],
    [t("quality"), robot.spread === undefined ? "–" : `${(robot.spread * 100).toFixed(0)} cm`],
  ];
  const stale = isStale(station, robot);
  return html`<section class="card" aria-label=${t("robot")}>
    <div class="row"><h2>${robot.name}</h2>${stale && html`<span class="lamp bad" id="robot-silent"><span class="dot"></span>${t("silent")} ${robot.pulse.age.toFixed(0)} s</span>`}<span class="grow"></span>
      ${charge >= 0 && html`<span class="battery ${charge < 0.2 ? "bad" : ""}">${t("battery")} <meter min="0" max="1" low="0.2" value=${charge} aria-label=${t("battery")}></meter> ${Math.round(charge * 100)} %</span>`}</div>
    <dl class="figures grid ${stale ? "stale" : ""}">${figures.map(([name, value]) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>
  </section>`;
}

function Alarms({ station, t }) {
  const alarms = [...station.alarms.values()].sort((a, b) => a.acknowledged - b.acknowledged || b.time - a.time);
  if (!alarms.length) return html`<p class="muted">${t("noAlarms")}</p>`;
  return html`<ul class="list" id="alarm-list">${alarms.map((alarm) => html`<li key=${alarm.key} class="alarm ${alarm.level} ${alarm.acknowledged ? "known" : ""}">
    <div class="grow"><time>${clock(alarm.time)}</time> ${said(alarm.text, t)} ${!alarm.active && html`<i>(${t("over")})</i>`}</div>
    ${alarm.acknowledged ? html`<span class="muted">${t("acknowledged")}</span>` : html`<button onClick=${() => station.acknowledge(alarm.key)}>${t("acknowledge")}</button>`}</li>`)}</ul>`;
}

function Log({ station, t }) {
  if (!station.log.length) return html`<p class="muted">${t("noLog")}</p>`;
  return html`<ol class="log">${station.log.map((line) => html`<li key=${line.key} class=${line.level}><time>${clock(line.time)}</time> <b>${line.source}</b> ${said(line.text, t)}${line.count > 1 && html` <i>×${line.count}</i>`}</li>`)}</ol>`;
}

/** A component of a module that is loaded when it is first shown: three and uPlot are large. */
function Lazy({ load, ...props }) {
  const [loaded, setLoaded] = useState(null);
  useEffect(() => { load().then((component) => setLoaded(() => component)); }, []);
  return loaded && html`<${loaded} ...${props} />`;
}

const PANELS = { drive: Drive, tasks: Tasks, zones: ZonesPanel, alarms: Alarms, log: Log, plot: (props) => html`<${Lazy} load=${() => import("./plot.js").then((m) => m.Plot)} ...${props} />`, camera: Camera };

/** What there is to see, and, now, to do. */
function panelsOf(station) {
  const { drive, tasks, zones, ...rest } = PANELS;
  if (station.history) return { mission: Mission, ...rest };
  return station.watches ? { tasks, zones, ...rest } : PANELS;
}

function Panels({ station, t, theme, panel: chosen, setPanel }) {
  const panels = panelsOf(station), panel = panels[chosen] ? chosen : Object.keys(panels)[0];
  const Panel = panels[panel], open = [...station.alarms.values()].filter((alarm) => !alarm.acknowledged).length;
  const names = Object.keys(panels);
  const turn = (event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    const next = names[(names.indexOf(panel) + by + names.length) % names.length];
    setPanel(next);
    document.getElementById(`tab-${next}`).focus();
  };
  return html`<section class="card panels">
    <div role="tablist" aria-label=${t("panels")} onKeyDown=${turn}>${names.map((name) => html`<button role="tab" id="tab-${name}" aria-selected=${panel === name} aria-controls="panel" tabindex=${panel === name ? 0 : -1} onClick=${() => setPanel(name)}>${t(name)}${name === "alarms" && open > 0 && html` <span class="count">${open}</span>`}</button>`)}</div>
    <div role="tabpanel" id="panel" aria-labelledby="tab-${panel}" tabindex="0"><${Panel} key=${panel} station=${station} t=${t} theme=${theme} /></div></section>`;
}

function Stage({ station, t }) {
  const [tool, setTool] = useState("pan"), [mode, setMode] = useState("map"), [follow, setFollow] = useState(false), [open, setOpen] = useState(false);
  const [layers, setLayers] = useState({ costmap: true, scan: true, plan: true, zones: true });
  const view = useRef();
  const set = (x, y, yaw) => {
    if (station.watches) return undefined; // a tool that was taken up before the role was known
    if (tool === "zone") return station.zones.click(x, y);
    if (tool === "pose") station.estimate(x, y, yaw);
    else station.add(x, y, yaw, { now: tool === "goal" });
    if (tool !== "waypoint") setTool("pan");
  };
  const hints = { goal: "hintGoal", pose: "hintPose", waypoint: "hintWaypoint" };
  const toggle = (name, pressed, action) => html`<button id="tool-${name}" aria-pressed=${pressed} onClick=${action}>${t(name)}</button>`;
  return html`<section class="stage" aria-label=${t("map")}>
    ${mode === "map" ? html`<${MapCanvas} station=${station} tool=${tool} layers=${layers} follow=${follow} label=${t("mapLabel")} hold=${(it) => (view.current = it)} onset=${set} onpan=${() => setFollow(false)} />`
      : html`<${Lazy} load=${() => import("./scene.js").then((m) => m.Scene)} station=${station} label=${t("sceneLabel")} />`}
    <div class="bar top" role="toolbar" aria-label=${t("tools")}>
      ${toggle("view3d", mode === "3d", () => setMode(mode === "map" ? "3d" : "map"))}
      ${mode === "map" && !station.watches && ["goal", "waypoint", "pose", "zone"].map((name) => toggle(name, tool === name, () => setTool(tool === name ? "pan" : name)))}</div>
    ${mode === "map" && hints[tool] && html`<div class="hint" role="status">${t(hints[tool])}</div>`}
    ${mode === "map" && tool === "zone" && html`<${ZoneBar} station=${station} t=${t} done=${() => setTool("pan")} />`}
    ${mode === "map" && html`<div class="bar bottom" role="toolbar" aria-label=${t("layers")}>
      <button class="icon" aria-label=${t("zoomOut")} onClick=${() => view.current.zoom(0.8)}>−</button><button class="icon" aria-label=${t("zoomIn")} onClick=${() => view.current.zoom(1.25)}>+</button>
      <button onClick=${() => { setFollow(false); view.current.fit(); }}>${t("fit")}</button>${toggle("follow", follow, () => setFollow(!follow))}
      <button id="layers" class="narrow" aria-expanded=${open} onClick=${() => setOpen(!open)}>${t("layers")}</button>
      <span class="layers ${open ? "" : "wide"}">${Object.keys(layers).map((name) => toggle(name, layers[name], () => setLayers({ ...layers, [name]: !layers[name] })))}</span></div>`}
  </section>`;
}

function App({ station }) {
  const [, refresh] = useReducer((count) => count + 1, 0);
  const [language, setLanguage] = useState(kept("language", navigator.language.startsWith("zh") ? "zh" : "en"));
  const [theme, setTheme] = useState(kept("theme", matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"));
  const [panel, setPanel] = useState("drive"), [naming, setNaming] = useState(false);
  useEffect(() => { station.addEventListener("change", refresh); return () => station.removeEventListener("change", refresh); }, []);
  useEffect(() => { station.addEventListener("proposal", () => setPanel("tasks")); }, []);
  useEffect(() => { document.documentElement.lang = language; keep("language", language); }, [language]);
  useLayoutEffect(() => { document.documentElement.dataset.theme = theme; keep("theme", theme); }, [theme]);
  const t = wordsOf(language), props = { station, t, theme, editName: () => setNaming(true) }, display = { ...props, setTheme, language, setLanguage }, narrow = useNarrow();
  return html`<div class="head"><${Header} ...${display} narrow=${narrow} /><${Banner} ...${props} /><${Notice} ...${props} /></div><${HistoryBar} ...${props} />
    <${NameDialog} ...${props} shown=${naming} close=${() => setNaming(false)} rename=${rename} />
    ${station.ros.refused ? html`<main class="outside"><${TokenForm} ...${props} enter=${enter} />${narrow && html`<div class="row end"><${Display} ...${display} /></div>`}</main>` : html`<main><${Stage} ...${props} /><aside aria-label=${t("panels")}>
      ${narrow && html`<section class="row display" aria-label=${t("display")}><${Figures} ...${props} /><span class="grow"></span><${Display} ...${display} /></section>`}
      <${RobotCard} ...${props} />${!station.watches && html`<${Simulation} ...${props} />`}<div class="narrow"><${ControlBar} ...${props} edit=${props.editName} /></div><${Panels} ...${props} panel=${panel} setPanel=${setPanel} /></aside></main>`}`;
}

/** Come in with another token; the one in the address is over, a reload would tell it again. */
function enter(token) {
  const address = new URL(location);
  address.searchParams.delete("token");
  history.replaceState(null, "", address);
  sessionStorage.setItem("twin.token", token);
  station.ros.enter(token);
}

function rename(name) {
  keep("name", name);
  station.control.rename(name);
}

const given = new URLSearchParams(location.search).get("token");
const ros = new Rosbridge(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`, given ?? sessionStorage.getItem("twin.token") ?? "");
const station = new Station(ros, kept("name", "").replace(/^page \d{3}$/, "")); // names that the page once gave itself
station.zones = new Zones(station);
render(html`<${App} station=${station} />`, document.getElementById("app"));
