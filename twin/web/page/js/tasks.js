/** What a robot is to do: its own queue of tasks if it has one, else goals that this page sends one after the other. */

import { html, useEffect, useRef, useState } from "ui";
import { quaternionOf, yawOf } from "./transforms.js";
import { clock } from "./words.js";

const STATES = ["waiting", "active", "succeeded", "failed", "canceled"];
const PENDING = 0, ACTIVE = 1;
const ENDED_SHOWN = 5;
const NEAR_M = 0.4;
const TRIGGER = "std_srvs/srv/Trigger";
const degrees = (yaw) => Math.round((yaw * 180) / Math.PI);

/** Ask the selected robot's queue for something; what it says is for the operator to read. */
export async function askQueue(station, service, type, args = {}) {
  try {
    const answer = await station.ros.call(`${station.robot.space}/${service}`, type, args);
    station.said = { text: answer.message, refused: !answer.success };
  } catch (error) {
    station.said = { text: error.message, refused: true };
    station.refuse(error.message);
  }
  station.changed();
  return !station.said.refused;
}

const addTask = (station, task, position = 0) => askQueue(station, "add_task", "twin_msgs/srv/AddTask", { task, position });

/** A point of the map as a task: a place that is named there, or the pose. A tote is proposed in the form. */
export async function addPlace(station, x, y, yaw, now) {
  const { places = [], pose } = station.robot;
  const there = places.find((each) => each.kind !== "slot" && Math.hypot(each.pose.position.x - x, each.pose.position.y - y) < NEAR_M);
  if (there?.kind === "tote") {
    station.propose({ type: "carry", tote: there.name });
    return;
  }
  if (now) {
    if (!(await askQueue(station, "clear_tasks", TRIGGER))) return;
    await askQueue(station, "resume_tasks", TRIGGER);
  }
  const target = { header: { frame_id: pose.root }, pose: { position: { x, y, z: 0 }, orientation: quaternionOf(yaw) } };
  await addTask(station, there?.kind === "pose" ? { type: "drive_to", place: there.name } : there ? { type: "dock", dock: there.name } : { type: "drive_to", pose: target });
}

function describe({ type, place, pose, tote, to, dock, duration }, t) {
  const { position: p, orientation: q } = pose.pose;
  const what = {
    drive_to: () => place || `${p.x.toFixed(2)}, ${p.y.toFixed(2)} · ${degrees(yawOf([q.x, q.y, q.z, q.w]))}°`,
    carry: () => `${tote} → ${to}`, dock: () => dock, undock: () => "", wait: () => `${duration.sec + duration.nanosec * 1e-9} s`,
  }[type];
  return `${t(`task_${type}`)} ${what?.() ?? ""}`.trim();
}

/** Draw what tasks can name, and where those go that are to be done. */
export function drawTasks(c, view, robot, colour) {
  c.font = "12px system-ui, sans-serif";
  c.textAlign = "center";
  c.lineWidth = 2;
  for (const { kind, name, pose } of robot.places ?? []) {
    if (kind === "slot") continue;
    const [x, y] = view.pixel([pose.position.x, pose.position.y]);
    c.strokeStyle = c.fillStyle = colour(kind === "tote" ? "goods" : "accent");
    c.strokeRect(x - 5, y - 5, 10, 10);
    if (view.scale > 25) c.fillText(name, x, y + 20);
  }
  const goals = (robot.tasks?.tasks ?? []).filter(({ state, task }) => state <= ACTIVE && task.type === "drive_to" && !task.place);
  goals.forEach(({ state, task: { pose: { pose: { position: p, orientation: q } } } }, i) =>
    view._flag(c, [p.x, p.y], yawOf([q.x, q.y, q.z, q.w]), colour("accent"), state === ACTIVE ? "" : String(i + 1)));
}

// What is typed stays: a value would be set again with every message.
const Choice = ({ name, label, options, chosen }) => html`<label class="small">${label}<select name=${name}>
  ${options.map((option) => html`<option value=${option} selected=${option === chosen}>${option}</option>`)}</select></label>`;
const Figure = ({ name, label, first = 0, min }) => html`<label class="small">${label}<input name=${name} type="number" step="any" min=${min} defaultValue=${first} required /></label>`;

function AddTask({ station, t }) {
  const places = station.robot.places ?? [], draft = station.draft ?? {};
  const named = (kind) => places.filter((each) => each.kind === kind).map(({ name }) => name);
  const [poses, totes, slots, docks] = ["pose", "tote", "slot", "dock"].map(named);
  const types = ["drive_to", ...(totes.length ? ["carry"] : []), ...(docks.length ? ["dock", "undock"] : []), "wait"];
  const [type, setType] = useState(draft.type ?? types[0]), [place, setPlace] = useState(poses[0] ?? "");
  useEffect(() => { if (draft.type) setType(draft.type); }, [draft]);
  const add = (event) => {
    event.preventDefault();
    const value = (name) => event.target.elements[name]?.value ?? "";
    const [x, y, heading, seconds] = ["x", "y", "heading", "seconds"].map((name) => Number(value(name)));
    const pose = { header: { frame_id: station.robot.pose.root }, pose: { position: { x, y, z: 0 }, orientation: quaternionOf((heading * Math.PI) / 180) } };
    const duration = { sec: Math.floor(seconds), nanosec: Math.round((seconds % 1) * 1e9) };
    const task = { drive_to: place ? { place } : { pose }, carry: { tote: value("tote"), to: value("to") }, dock: { dock: value("dock") }, undock: {}, wait: { duration } }[type];
    addTask(station, { type, ...task });
  };
  return html`<form id="add-task" onSubmit=${add}>
    <div class="row">
      <label class="small">${t("taskType")}<select name="type" value=${type} onChange=${(event) => setType(event.target.value)}>${types.map((each) => html`<option value=${each}>${t(`task_${each}`)}</option>`)}</select></label>
      ${type === "drive_to" && html`<label class="small">${t("place")}<select name="place" value=${place} onChange=${(event) => setPlace(event.target.value)}>
        ${poses.map((each) => html`<option value=${each}>${each}</option>`)}<option value="">${t("pose")}</option></select></label>`}
      ${type === "carry" && html`<${Choice} key=${draft.tote} name="tote" label=${t("tote")} options=${totes} chosen=${draft.tote} /><${Choice} name="to" label=${t("to")} options=${slots} />`}
      ${type === "dock" && html`<${Choice} name="dock" label=${t("dock")} options=${docks} />`}
      ${type === "wait" && html`<${Figure} name="seconds" label=${t("seconds")} first="10" min="0.1" />`}
      ${(type !== "drive_to" || place) && html`<button>${t("add")}</button>`}</div>
    ${type === "drive_to" && !place && html`<div class="row">${["x", "y", "heading"].map((name) => html`<${Figure} name=${name} label=${t(name)} />`)}<button>${t("add")}</button></div>`}
  </form>`;
}

function RobotQueue({ station, t }) {
  const { paused, reason, tasks } = station.robot.tasks, { said } = station;
  const ended = tasks.filter(({ state }) => state > ACTIVE).length, pending = tasks.filter(({ state }) => state === PENDING);
  const shown = tasks.slice(Math.max(0, ended - ENDED_SHOWN));
  const pressed = useRef();
  useEffect(() => { // the button that moved a task keeps the focus
    const button = document.getElementById(pressed.current);
    if (button && document.activeElement !== button) button.focus();
    pressed.current = undefined;
  }, [pending.map(({ id }) => id).join()]);
  const move = (id, position, button) => {
    pressed.current = button;
    askQueue(station, "move_task", "twin_msgs/srv/MoveTask", { id, position });
  };
  const item = ({ id, state, task, step, error }) => {
    const at = pending.findIndex((each) => each.id === id) + 1, words = describe(task, t);
    const button = (name, by) => { // one that cannot go on keeps the focus, so it is not disabled
      const idle = at + by < 1 || at + by > pending.length;
      return html`<button class="icon" id="${name}-${id}" aria-label="${t(name)}: ${words}" aria-disabled=${idle} onClick=${() => idle || move(id, at + by, `${name}-${id}`)}>${by < 0 ? "↑" : "↓"}</button>`;
    };
    return html`<li key=${id} data-state=${STATES[state]} data-id=${id}>
      <div class="grow"><b>${words}</b><br /><span class="state ${STATES[state]}">${t(`task_${STATES[state]}`)} ${state === ACTIVE ? step.replace(/^task \d+: /, "") : error}</span></div>
      ${state === PENDING && !station.watches && html`${button("earlier", -1)}${button("later", 1)}`}
      ${state <= ACTIVE && !station.watches && html`<button class="icon" aria-label="${t("cancel")}: ${words}" onClick=${() => askQueue(station, "cancel_task", "twin_msgs/srv/CancelTask", { id })}>✕</button>`}</li>`;
  };
  return html`
    <p class="muted">${t("robotQueueNote")}</p>
    ${paused && html`<p id="held" class="warn" role="status">${t("held")}: ${reason}</p>`}
    ${shown.length === 0 && html`<p class="muted">${t("noTasks")}</p>`}
    <ul class="list" id="queue">${shown.map(item)}</ul>
    ${!station.watches && html`<${AddTask} station=${station} t=${t} />`}
    <p id="said" role="status" class=${said?.refused ? "bad" : "muted"}>${t(said?.text ?? "")}</p>
    <div class="row" hidden=${station.watches}>${paused ? html`<button id="resume-tasks" class="primary" onClick=${() => askQueue(station, "resume_tasks", TRIGGER)}>${t("resume")}</button>` : html`<button id="pause-tasks" onClick=${() => askQueue(station, "pause_tasks", TRIGGER)}>${t("hold_")}</button>`}
      ${shown.some(({ state }) => state <= ACTIVE) && html`<button id="clear-tasks" onClick=${() => askQueue(station, "clear_tasks", TRIGGER)}>${t("clearTasks")}</button>`}</div>`;
}

function PageQueue({ station, t }) {
  const add = (event) => {
    event.preventDefault();
    const value = (name) => Number(event.target.elements[name].value) || 0;
    station.add(value("x"), value("y"), (value("heading") * Math.PI) / 180);
  };
  const isOfMany = station.robots.size > 1;
  return html`
    <p class="muted">${t("queueNote")}</p>
    ${station.queue.length === 0 && html`<p class="muted">${t("empty")}</p>`}
    <ul class="list" id="queue">${station.queue.map((goal) => html`<li key=${goal.id} data-state=${goal.state}>
      <div class="grow">${isOfMany && html`<span class="badge">${goal.robot.name}</span> `}<b>${goal.x.toFixed(2)}, ${goal.y.toFixed(2)}</b> · ${degrees(goal.yaw)}°<br />
        <span class="state ${goal.state}">${t(goal.state === "waiting" ? "state_waiting" : goal.state)}${goal.state === "active" && goal.left !== undefined ? ` · ${goal.left.toFixed(1)} ${t("left")}` : ""} ${t(goal.why ?? "")}</span></div>
      ${goal.state === "waiting" && html`<button class="icon" aria-label=${t("earlier")} onClick=${() => station.move(goal.id, -1)}>↑</button><button class="icon" aria-label=${t("later")} onClick=${() => station.move(goal.id, 1)}>↓</button>`}
      <button class="icon" aria-label=${t("cancel")} onClick=${() => station.cancel(goal.id)}>✕</button></li>`)}</ul>
    <form class="row" onSubmit=${add}>
      ${["x", "y", "heading"].map((name) => html`<${Figure} name=${name} label=${t(name)} />`)}
      <button>${t("add")}</button></form>
    ${isOfMany && html`<p class="muted">${t("goesTo")} ${station.robot?.name}</p>`}
    ${station.holding ? html`<button onClick=${() => station.resumeQueue()}>${t("resume")}</button>` : station.queue.length > 0 && html`<button onClick=${() => station.pauseQueue()}>${t("hold_")}</button>`}`;
}

export function Tasks({ station, t }) {
  const robot = station.robot, states = robot?.mission ?? [];
  return html`
    <h3>${t("mission")}</h3>
    ${states.length ? html`<ol class="steps">${states.slice(-8).map((step, i, all) => html`<li class=${i === all.length - 1 ? "now" : ""}><time>${clock(step.time)}</time> ${step.state}</li>`)}</ol>` : html`<p class="muted">${t("noMission")}</p>`}
    ${(robot?.tasks || !station.watches) && html`<h3>${t(robot?.tasks ? "robotQueue" : "queue")}</h3>`}
    ${robot?.tasks ? html`<${RobotQueue} key=${robot.space} station=${station} t=${t} />` : !station.watches && html`<${PageQueue} station=${station} t=${t} />`}`;
}
