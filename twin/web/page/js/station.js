/** What the page knows of robots: found in the graph by types and names of topics, kept as messages come. */

import { Alarms } from "./alarms.js";
import { Control } from "./control.js";
import { Pulse, watchSilence } from "./silence.js";
import { addPlace } from "./tasks.js";
import { Frames, compose, place, poseOf, quaternionOf } from "./transforms.js";
import { TiledGrid, WholeGrid } from "./grids.js";
import { HISTORY, takeHistory } from "./history.js";

const GRAPH_MS = 3000;
const LOG_LINES = 300;
const ODOMETRY = "nav_msgs/msg/Odometry";
const GRID = "nav_msgs/msg/OccupancyGrid";
const LEVELS = { 10: "debug", 20: "info", 30: "warn", 40: "error", 50: "fatal" };
const GOAL = { name: "navigate_to_pose", type: "nav2_msgs/action/NavigateToPose" };
const SUCCEEDED = 4, CANCELED = 5;
const STOP_AGAIN_MS = 200;
const STOP_UNHEARD_MS = 10_000;
const NOTICE_MS = 8000;
const TELEOPS = ["guard/teleop", "cmd_vel_teleop", "cmd_vel", "turtle1/cmd_vel"]; // as `twin teleop` looks for them: past a guard nobody drives
const ROLE_MAY_NOT = /is not for the role|may not steer/; // today, nor ever
const HAS_CONTROL = /^(.*) has control/;

const seconds = ({ sec, nanosec }) => sec + nanosec * 1e-9;

/** A robot: everything below one namespace. */
class Robot {
  constructor(space) {
    this.space = space;
    this.name = space.slice(1) || "robot";
    this.base = "base_footprint";
    this.pulse = new Pulse();
    this.grids = {}; // map, global, local, or a mask's topic -> a grid of grids.js
    this.forget();
  }

  /** Know nothing of what was said of now: a bag goes to another time. */
  forget() {
    this.frames = new Frames();
    this.velocity = { linear: 0, angular: 0 };
    this.mission = []; // {state, time}
    for (const name of ["scan", "plan", "goods", "people", "footprint", "battery", "spread", "joints", "guard"]) this[name] = undefined;
    for (const [key, grid] of Object.entries(this.grids)) if (grid instanceof WholeGrid) delete this.grids[key];
  }

  /** {root, pose} of the base. */
  get pose() {
    return this.frames.lookup(this.base);
  }
}

export class Station extends EventTarget {
  constructor(ros, name) {
    super();
    this.ros = ros;
    this.control = new Control(this, name);
    this.robots = new Map();
    this.selected = "";
    this.types = new Map(); // topic -> type
    this.log = [];
    this.alarms = new Alarms();
    this.clock = { time: null, factor: null };
    this.notice = null; // {key, words(t)}: of what was refused, for people
    this.queue = []; // {id, x, y, yaw, state: waiting | active | succeeded | canceled | failed, left}
    this.holding = false;
    this._goals = 0;
    this._heard = new Set();
    ros.addEventListener("connection", () => this._connection());
    ros.addEventListener("status", ({ detail }) => this.note(detail.level, "rosbridge", detail.msg));
    ros.addEventListener("refused", ({ detail }) => this._refused(detail));
    watchSilence(this);
    setInterval(() => this._look(), GRAPH_MS);
    setInterval(() => this.changed(), 500); // ages of what was heard
  }

  get robot() {
    return this.robots.get(this.selected);
  }

  /** Where something is on the server of the page; the token goes with it. */
  address(path, query) {
    const { token } = this.ros;
    return `${path}?${new URLSearchParams(token ? { ...query, token } : query)}`;
  }

  forget() {
    this.ros.forget();
    this.robots.forEach((robot) => robot.forget());
    this.log = [];
    this.alarms.clear();
    this.changed();
  }

  select(space) {
    this.selected = space;
    this.changed();
  }

  changed() {
    if (this._pending) return;
    this._pending = setTimeout(() => {
      this._pending = 0;
      this.dispatchEvent(new Event("change"));
    }, 60);
  }

  /** Add a line to the log; what is said again is counted. */
  note(level, source, text, time = this.clock.time) {
    const [last] = this.log;
    if (last && last.level === level && last.source === source && last.text === text) {
      Object.assign(last, { time, count: last.count + 1 });
      this.changed();
      return;
    }
    this.log.unshift({ level, source, text, time, count: 1, key: ++this._goals });
    this.log.length = Math.min(this.log.length, LOG_LINES);
    this.changed();
  }

  /** Tell people something now; the same is not told again while it is shown. */
  tell(words) {
    const text = words((key) => key);
    if (this.notice?.text !== text) this.notice = { text, words, key: ++this._goals };
    clearTimeout(this._noticed);
    this._noticed = setTimeout(() => this.dismiss(), NOTICE_MS);
    this.changed();
  }

  dismiss() {
    this.notice = null;
    this.changed();
  }

  /** Tell that a command was refused; `why` is the server's sentence. */
  refuse(why) {
    const other = HAS_CONTROL.exec(why)?.[1];
    this.tell((t) => (other ? `${other} ${t("refusedOther")}` : ROLE_MAY_NOT.test(why) ? `${t("refusedRole")} (${this.control.state?.role ?? ""})` : `${t("refused")}: ${why}`));
  }

  /** What was published is refused: who repeats it ends that. */
  _refused({ topic, why }) {
    this.refuse(why);
    for (const robot of this.robots.values())
      if (topic === `${robot.space}/guard/stop` && ROLE_MAY_NOT.test(why)) Object.assign(robot, { stopAsked: 0, stopRefused: true });
    this.dispatchEvent(new CustomEvent("refused", { detail: topic }));
  }

  /** Raise or end an alarm, as `Alarms` says. */
  alarm(key, level, text, { time = this.clock.time ?? Date.now() / 1000, ...more } = {}) {
    if (this.alarms.raise(key, level, text, { time, ...more })) this.changed();
  }

  acknowledge(key) {
    this.alarms.acknowledge(key);
    this.changed();
  }

  _connection() {
    this.robots.forEach((robot) => (robot.stopRefused = false)); // perhaps by another token
    if (this.ros.connected) this._look();
    else this.queue.forEach((goal) => goal.state === "active" && (goal.state = "failed"));
    this.alarm("connection", "error", (t) => t("connection"), { active: !this.ros.connected && !this.ros.refused });
    this.changed();
  }

  async _look() {
    if (!this.ros.connected) return;
    try {
      const found = await this.ros.call("/rosapi/topics", "rosapi_msgs/srv/Topics");
      this.types = new Map(found.topics.map((topic, i) => [topic, found.types[i]]));
      const { services } = await this.ros.call("/rosapi/services", "rosapi_msgs/srv/Services");
      this.services = new Set(services);
      const { action_servers } = await this.ros.call("/rosapi/action_servers", "rosapi_msgs/srv/GetActionServers").catch(() => ({ action_servers: [] }));
      this.actions = new Set(action_servers);
    } catch (error) {
      this.note("warn", "rosapi", error.message);
      return;
    }
    const robotsFirst = [...this.types].sort((a, b) => (b[1] === ODOMETRY) - (a[1] === ODOMETRY)); // what belongs to one finds it
    for (const [topic, type] of robotsFirst) this._hear(topic, type);
    if (!this.robots.has(this.selected) && this.robots.size) this.selected = [...this.robots.keys()].sort()[0];
    this.changed();
  }

  _robot(space) {
    if (!this.robots.has(space)) this.robots.set(space, new Robot(space));
    return this.robots.get(space);
  }

  /** The robot to which a topic belongs: the longest namespace of one that begins its name. */
  _owner(topic) {
    const spaces = [...this.robots.keys()].filter((space) => topic.startsWith(`${space}/`));
    return this.robots.get(spaces.sort((a, b) => b.length - a.length)[0]);
  }

  _hear(topic, type) {
    if (this._heard.has(topic)) return;
    const at = topic.lastIndexOf("/");
    const space = topic.slice(0, at), last = topic.slice(at + 1);
    const hear = (callback, throttle) => {
      this._heard.add(topic);
      this.ros.subscribe(topic, type, (msg) => {
        callback(msg);
        this.changed();
      }, throttle);
    };
    const owned = (callback, throttle) => hear((msg) => {
      const robot = this._owner(topic);
      if (robot) callback(robot, msg);
    }, throttle);

    if (type === ODOMETRY && last === "odom") {
      const robot = this._robot(space);
      hear((msg) => {
        robot.pulse.beat();
        robot.base = msg.child_frame_id;
        robot.odometry = msg;
        robot.velocity = { linear: msg.twist.twist.linear.x, angular: msg.twist.twist.angular.z };
      }, 100);
    } else if (type === "tf2_msgs/msg/TFMessage" && (last === "tf" || last === "tf_static"))
      hear((msg) => this._robotsIn(space).forEach((robot) => robot.frames.take(msg, last === "tf_static")), 0);
    else if (type === GRID) {
      const kind = topic.endsWith("global_costmap/costmap") ? "global" : topic.endsWith("local_costmap/costmap") ? "local" : last === "map" ? "map" : /mask|^vo_map$/.test(last) ? "zones" : "";
      if (kind) this._grid(topic, kind);
    } else if (type === "sensor_msgs/msg/LaserScan" && last === "scan") owned(takeScan, 150);
    else if (type === "nav_msgs/msg/Path" && last === "plan") owned((robot, msg) => (robot.plan = msg), 200);
    else if (type === "geometry_msgs/msg/PolygonStamped" && topic.endsWith("local_costmap/published_footprint"))
      owned((robot, msg) => (robot.footprint = msg), 200);
    else if (type === HISTORY) hear((msg) => takeHistory(this, msg));
    else if (type === "sensor_msgs/msg/BatteryState") owned((robot, msg) => (robot.battery = msg), 1000);
    else if (type === "sensor_msgs/msg/JointState" && last === "joint_states")
      owned((robot, msg) => (robot.joints = msg), 100);
    else if (type === "std_msgs/msg/String" && last === "robot_description") owned((robot, msg) => (robot.urdf = msg.data));
    else if (type === "std_msgs/msg/String" && last === "label") owned((robot, msg) => (robot.label = msg.data));
    else if (type === "std_msgs/msg/String" && topic.endsWith("mission/state"))
      owned((robot, msg) => {
        if (robot.mission.at(-1)?.state !== msg.data) robot.mission.push({ state: msg.data, time: this.clock.time });
      });
    else if (type === "geometry_msgs/msg/PoseArray" && last === "tote_poses") owned((robot, msg) => (robot.goods = new Seen(robot, msg.header, msg.poses.map(poseOf), compose)), 500);
    else if (type === "geometry_msgs/msg/PoseArray" && last === "people") owned((robot, msg) => (robot.people = new Seen(robot, msg.header, msg.poses.map(poseOf), compose)), 200);
    else if (type === "geometry_msgs/msg/PoseWithCovarianceStamped" && last === "amcl_pose")
      owned((robot, msg) => (robot.spread = Math.sqrt(Math.max(0, msg.pose.covariance[0] + msg.pose.covariance[7]))), 200);
    else if (type === "diagnostic_msgs/msg/DiagnosticArray" && topic.endsWith("guard/status"))
      owned((robot, msg) => this._guard(robot, msg));
    else if (topic === "/diagnostics") hear((msg) => msg.status.forEach((s) => this.alarm(`diagnostics ${s.name}`, s.level > 1 ? "error" : "warn", `${s.name}: ${s.message}`, { active: s.level > 0, time: seconds(msg.header.stamp) })));
    else if (topic === "/rosout")
      hear((msg) => {
        const level = LEVELS[msg.level] ?? "info";
        const time = seconds(msg.stamp);
        this.note(level, msg.name, msg.msg, time);
        if (msg.level >= 40) this.alarm(`log ${msg.name}`, "error", `${msg.name}: ${msg.msg}`, { time, isEvent: true });
      });
    else if (topic === "/clock") hear((msg) => this._time(msg.clock), 500);
    else if (type === "twin_msgs/msg/TaskQueue") owned((robot, msg) => (robot.tasks = msg));
    else if (type === "twin_msgs/msg/Places") owned((robot, msg) => (robot.places = msg.places));
    else if (topic === "/simulation/state") hear((msg) => this._simulated(msg));
    else if (topic === "/twin/control") hear((msg) => this.control.told(msg));
  }

  /** Show a grid: in tiles if there are some; the local costmap, small and always another, whole. */
  async _grid(topic, kind) {
    this._heard.add(topic);
    try {
      const tiled = kind === "local" ? null : await TiledGrid.open(this, topic, kind);
      if (tiled) this._owner(topic).grids[kind === "zones" ? topic : kind] = tiled; // there may be several masks
      else this._wholeGrid(topic, kind);
    } catch {
      this._heard.delete(topic); // not now: it is looked again
    }
    this.changed();
  }

  _wholeGrid(topic, kind) {
    const grid = new WholeGrid(kind);
    this.ros.subscribe(topic, GRID, (message) => {
      const robot = this._owner(topic);
      grid.take(message);
      if (robot) robot.grids[kind === "zones" ? topic : kind] = grid;
      this.changed();
    }, kind === "map" ? 0 : 500);
    this.ros.subscribe(`${topic}_updates`, "map_msgs/msg/OccupancyGridUpdate", (update) => grid.patch(update));
  }

  _robotsIn(space) {
    return [...this.robots.values()].filter((robot) => !space || robot.space === space);
  }

  _time({ sec, nanosec }) {
    if (this.history) return; // which has a time of its own
    const time = seconds({ sec, nanosec }), now = performance.now() / 1000;
    const { time: before, at } = this.clock;
    const factor = before !== null && now > at ? (time - before) / (now - at) : null;
    this.clock = { time, at: now, factor: this.clock.factor === null ? factor : 0.7 * this.clock.factor + 0.3 * factor };
  }

  /** Take how the simulation goes on; one that begins anew has no past. */
  _simulated(message) {
    if (this.simulation && this.simulation.resets !== message.resets) {
      this.robots.forEach((robot) => Object.assign(robot, { mission: [], plan: undefined }));
      this.clock = { time: null, factor: null };
      this.note("info", "simulation", (t) => t("begunAnew"));
    }
    this.simulation = message;
  }

  _guard(robot, message) {
    const status = message.status.find((each) => each.name === "guard");
    if (!status) return;
    const by = status.values.find(({ key }) => key === "stopped_by")?.value ?? "";
    robot.guard = { stoppedBy: by, stamp: message.header.stamp };
    if (by) robot.stopAsked = 0;
    this.alarm(`guard ${robot.space}`, "error", (t) => `${robot.name}: ${t("stop")} (${by})`, { active: Boolean(by), time: seconds(robot.guard.stamp) });
  }

  /** Press the emergency stop of all robots; said again until each tells that it is stopped, not for ever to one without a guard. */
  stop() {
    for (const robot of this.robots.values()) {
      robot.stopAsked = performance.now();
      const press = () => {
        if (!robot.stopAsked || (!robot.guard && performance.now() - robot.stopAsked > STOP_UNHEARD_MS)) return;
        this.ros.publish(`${robot.space}/guard/stop`, "std_msgs/msg/Header", { frame_id: this.control.signature });
        setTimeout(press, STOP_AGAIN_MS);
      };
      press();
    }
    this.pauseQueue();
    this.changed();
  }

  /** Release what is stopped, by the status that the operator saw. */
  release() {
    for (const robot of this.robots.values())
      if (robot.guard?.stoppedBy)
        this.ros.publish(`${robot.space}/guard/release`, "std_msgs/msg/Header", { stamp: robot.guard.stamp, frame_id: this.control.signature });
  }

  get stopped() {
    return [...this.robots.values()].filter((robot) => robot.guard?.stoppedBy);
  }

  /** Whether there is nothing to command: a bag, or a role that only looks. */
  get watches() {
    return Boolean(this.history) || this.control.watches;
  }

  /** Whether a goal of this page is under way. */
  get hasGoal() {
    return this.queue.some(({ state }) => state === "active");
  }

  /** Topic and type for velocities by hand: before the guard, else the multiplexer, if there is one. */
  get teleop() {
    const space = this.robot?.space ?? "";
    const topic = TELEOPS.map((name) => `${space}/${name}`).find((name) => this.types.has(name));
    return topic && { topic, type: this.types.get(topic) };
  }

  drive(linear, angular) {
    const { topic, type } = this.teleop ?? {};
    if (!topic) return false;
    const twist = { linear: { x: linear, y: 0, z: 0 }, angular: { x: 0, y: 0, z: angular } };
    return this.ros.publish(topic, type, type.endsWith("TwistStamped") ? { header: { frame_id: this.robot.base }, twist } : twist);
  }

  async estimate(x, y, yaw) {
    const covariance = new Array(36).fill(0);
    covariance[0] = covariance[7] = 0.25; // as RViz gives it: 0.5 m
    covariance[35] = (Math.PI / 12) ** 2;
    const robot = this.robot;
    const words = (t) => `${t("estimated")} ${x.toFixed(2)} ${y.toFixed(2)} ${yaw.toFixed(2)}`;
    try {
      await this.ros.say(`${robot.space}/initialpose`, "geometry_msgs/msg/PoseWithCovarianceStamped", {
        header: { frame_id: robot.pose.root },
        pose: { pose: { position: { x, y, z: 0 }, orientation: quaternionOf(yaw) }, covariance },
      });
      this.note("info", "page", words);
    } catch (error) {
      this.note("warn", "page", (t) => `${t("refused")}: ${words(t)}: ${error.message}`);
    }
  }

  /** Propose a task, for an operator to complete. */
  propose(task) {
    this.draft = task;
    this.dispatchEvent(new Event("proposal"));
    this.changed();
  }

  /** Put a goal at the end of the queue, or in place of all of it. */
  add(x, y, yaw, { now = false } = {}) {
    if (this.robot.tasks) {
      addPlace(this, x, y, yaw, now);
      return;
    }
    if (now) this.clear(this.robot);
    this.queue.push({ id: ++this._goals, robot: this.robot, x, y, yaw, state: "waiting" });
    if (now) this.holding = false;
    this._next();
  }

  move(id, by) {
    const from = this.queue.findIndex((goal) => goal.id === id), { robot } = this.queue[from];
    let to = from + by;
    while (this.queue[to] && this.queue[to].robot !== robot) to += by; // among its own
    if (this.queue[to]?.state !== "waiting") return;
    [this.queue[from], this.queue[to]] = [this.queue[to], this.queue[from]];
    this.changed();
  }

  cancel(id) {
    const goal = this.queue.find((each) => each.id === id);
    if (goal?.state === "active") goal.handle.cancel();
    else this.queue = this.queue.filter((each) => each.id !== id);
    this.changed();
  }

  /** Take back what a robot is to do; what others do goes on. */
  clear(robot) {
    this.queue.filter((goal) => goal.robot === robot && goal.state === "active").forEach((goal) => goal.handle.cancel());
    this.queue = this.queue.filter((goal) => goal.robot !== robot || goal.state === "active");
    this.changed();
  }

  pauseQueue() {
    this.holding = true;
    this.changed();
  }

  resumeQueue() {
    this.holding = false;
    this._next();
  }

  _next() {
    this.changed();
    for (const robot of this.robots.values()) {
      if (this.holding || this.queue.some((goal) => goal.robot === robot && goal.state === "active")) continue;
      const goal = this.queue.find((each) => each.robot === robot && each.state === "waiting");
      if (goal) this._send(goal);
    }
  }

  async _send(goal) {
    goal.state = "active";
    const pose = { position: { x: goal.x, y: goal.y, z: 0 }, orientation: quaternionOf(goal.yaw) };
    const args = { pose: { header: { frame_id: goal.robot.pose.root }, pose } };
    goal.handle = this.ros.goal(`${goal.robot.space}/${GOAL.name}`, GOAL.type, args, (feedback) => {
      goal.left = feedback.distance_remaining;
      this.changed();
    });
    try {
      const { status, values } = await goal.handle.result;
      goal.state = status === SUCCEEDED ? "succeeded" : status === CANCELED ? "canceled" : "failed";
      goal.why = values?.error_msg ?? (typeof values === "string" ? values : "");
    } catch (error) {
      goal.state = "failed";
      goal.why = error.message;
    }
    if (HAS_CONTROL.test(goal.why) || ROLE_MAY_NOT.test(goal.why)) this.refuse(goal.why);
    if (goal.state === "failed") {
      this.holding = this.queue.some((each) => each.state === "waiting");
      this.alarm(`goal ${goal.id}`, "warn", (t) => `${goal.robot.name}: ${t("goal")} ${goal.x.toFixed(1)}, ${goal.y.toFixed(1)}: ${t(goal.why || "failed")}`, { isEvent: true });
    }
    this._next();
  }
}

/** Things that were seen from the robot: they stay where they were then, wherever it drives. */
class Seen {
  /** @param into what puts a thing of the header's frame into the frame of a pose: `compose` or `place` */
  constructor(robot, { frame_id: frame, stamp }, things, into) {
    Object.assign(this, { robot, frame, stamp, things, into });
  }

  /** Where they are, none as long as that is not known: the transforms of that time may come after them. */
  get placed() {
    if (this._placed) return this._placed;
    const { frames, base } = this.robot, found = frames.at(this.frame, this.stamp);
    if (!found) return [];
    const placed = this.things.map((thing) => this.into(found.pose, thing));
    const { root } = frames.lookup(base);
    if (found.root === root && root !== base) this._placed = placed;
    return root === base && found.root !== base ? [] : placed;
  }
}

function takeScan(robot, scan) {
  const points = [];
  scan.ranges.forEach((range, i) => {
    if (range === null || range < scan.range_min || range > scan.range_max) return;
    const angle = scan.angle_min + i * scan.angle_increment;
    points.push([range * Math.cos(angle), range * Math.sin(angle), 0]);
  });
  robot.scan = new Seen(robot, scan.header, points, place);
}
