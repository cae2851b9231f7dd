/** The page's sentences in its languages. */

const WORDS = {
  en: {
    past: "History", pastTime: "Time in the bag", playBag: "Play", pauseBag: "Pause",
    zone: "Zone", hintZone: "Click the corners in order around the zone; or type them under Zones", zoneAdd: "Keep out", zoneUndo: "Undo corner", zoneRemove: "Remove", zoneSure: "Really remove?", zoneNone: "No zones drawn", noZones: "This robot takes no zones",
    zoneLabel: "Corners, an x and a y [m] in each line", zoneCorners: "corners", zoneFew: "A zone needs three corners or more.", zoneNumbers: "Each line needs two numbers, x and y.", zoneCrosses: "Its edges cross: give the corners in order around the zone.", zoneRefused: "The robot refuses this zone; the log says why.",
    title: "Operator", connected: "Connected", disconnected: "No connection", silent: "silent for", stop: "Emergency stop", stopShort: "STOP",
    stopped: "Stopped by", stopping: "Stopping …", release: "Release", releaseAsk: "Release the emergency stop?", releaseText: "The robot may move as soon as it is commanded. Make sure that nobody is near it.",
    cancel: "Cancel", noStop: "This robot tells of no emergency stop", robot: "Robot", map: "Map", view3d: "3D", drive: "Drive", tasks: "Tasks", alarms: "Alarms", log: "Log", plot: "Plot", camera: "Camera",
    pan: "Move map", goal: "Goal", pose: "Pose", waypoint: "Waypoint", fit: "Fit", follow: "Follow", zoomIn: "Zoom in", zoomOut: "Zoom out", costmap: "Costmap", scan: "Scan", plan: "Plan", zones: "Zones", layers: "Layers",
    battery: "Battery", speed: "Speed", turn: "Turn", position: "Position", quality: "Spread of pose", waiting: "Waiting for a robot …", time: "Time", pace: "Pace",
    hold: "Hold the stick, or the keys W A S D. Let go and it stops.", maxSpeed: "Greatest speed", noDrive: "This robot takes no velocities", joystick: "Joystick: drag, or hold arrow keys",
    mission: "Mission", noMission: "No mission tells its state", queue: "Queue of goals", queueNote: "Kept in this page: goals go to the robot one after the other.", empty: "No goals. Choose Goal or Waypoint and click on the map.",
    earlier: "Earlier", later: "Later", x: "x [m]", y: "y [m]", heading: "Heading [°]", add: "Add", hold_: "Hold queue", resume: "Resume queue", left: "m left",
    active: "under way", state_waiting: "waiting", succeeded: "arrived", canceled: "cancelled", failed: "failed",
    noAlarms: "No alarms", acknowledge: "Acknowledge", acknowledged: "Acknowledged", over: "over", connection: "The connection to the robot is lost", noLog: "Nothing said yet",
    controlMine: "You have control", controlNone: "Nobody has control", controlOther: "has control", takeOver: "Take over", take: "Take control", giveBack: "Give back", theme: "Dark or light", language: "中文",
    silentSince: "silent since", controlTaken: "has taken control over", controlOver: "Control is over: it was not renewed", watching: "You watch", who: "Your name", name: "Name", nameNote: "Others see it while you have control, and after a stop. Without one it is that of your token.", keep: "Keep",
    refused: "Refused", refusedOther: "has control: take over first", refusedRole: "Your role may not do that", close: "Close", token: "Token", tokenAsked: "The server asks for a token", tokenWrong: "The server does not know this token, or has had too many wrong ones: then wait a minute.", tokenNote: "Kept until this tab is closed.", enter: "Come in",
    topic: "Topic", field: "Field", choose: "choose", noCamera: "No camera", mapLabel: "Map of the hall. Arrow keys move it, plus and minus zoom; goals can be typed under Tasks.", sceneLabel: "Robot in three dimensions",
    hintGoal: "Click where to go; drag for the heading", hintPose: "Click where the robot is; drag for its heading", hintWaypoint: "Click to add a goal to the queue; drag for the heading", panels: "Panels", tools: "Tools of the map", history: "Steps",
    robotQueue: "Queue of tasks", robotQueueNote: "Kept at the robot: it goes on without this page.", noTasks: "No tasks. Add one, or choose Waypoint and click on the map.", held: "The queue is held", clearTasks: "Cancel all", taskType: "Task", place: "Place", tote: "Tote", to: "To", dock: "Dock", seconds: "Seconds",
    task_drive_to: "Drive to", task_carry: "Carry", task_dock: "Dock at", task_undock: "Undock", task_wait: "Wait", task_waiting: "waiting", task_active: "under way:", task_succeeded: "done", task_failed: "failed:", task_canceled: "cancelled",
    unreached: "No connection: STOP does not reach the robot from here. Use the button at the robot.", display: "Time and display",
    estimated: "2D pose estimate", begunAnew: "begun anew", goesTo: "Goals are added for",
    simulation: "Simulation", play: "Play", pause: "Pause", paused: "Paused", step: "Step", fastest: "fastest", reset: "Reset", resetAsk: "Reset the simulation?", resetText: "It begins anew at its start. What has been recorded so far is lost.",
  },
  zh: {
    past: "历史回放", pastTime: "录包时间", playBag: "播放", pauseBag: "暂停",
    zone: "禁区", hintZone: "沿禁区边界依次点击各角点，也可在“区域”面板输入", zoneAdd: "设为禁区", zoneUndo: "撤销角点", zoneRemove: "删除", zoneSure: "确认删除？", zoneNone: "没有绘制的禁区", noZones: "该机器人不接收禁区",
    zoneLabel: "角点，每行一个 x 和 y [米]", zoneCorners: "个角点", zoneFew: "禁区至少需要三个角点。", zoneNumbers: "每行需要 x 和 y 两个数字。", zoneCrosses: "边线交叉：请沿边界依次给出角点。", zoneRefused: "机器人拒绝了该禁区，原因见日志。",
    title: "操作台", connected: "已连接", disconnected: "连接中断", silent: "无消息", stop: "紧急停止", stopShort: "急停",
    stopped: "急停操作者：", stopping: "正在停止 …", release: "解除", releaseAsk: "解除紧急停止？", releaseText: "解除后机器人收到指令即会移动。请确认附近无人。",
    cancel: "取消", noStop: "该机器人未提供紧急停止", robot: "机器人", map: "地图", view3d: "三维", drive: "驾驶", tasks: "任务", alarms: "报警", log: "日志", plot: "曲线", camera: "相机",
    pan: "移动地图", goal: "目标", pose: "位姿", waypoint: "航点", fit: "全图", follow: "跟随", zoomIn: "放大", zoomOut: "缩小", costmap: "代价地图", scan: "激光", plan: "路径", zones: "区域", layers: "图层",
    battery: "电量", speed: "速度", turn: "转速", position: "位置", quality: "位姿散布", waiting: "等待机器人 …", time: "时间", pace: "倍速",
    hold: "按住摇杆或 W A S D 键行驶，松开即停。", maxSpeed: "最高速度", noDrive: "该机器人不接收速度指令", joystick: "摇杆：拖动，或按住方向键",
    mission: "使命", noMission: "没有使命状态", queue: "目标队列", queueNote: "队列保存在本页面，目标依次发送给机器人。", empty: "没有目标。选择“目标”或“航点”后点击地图。",
    earlier: "提前", later: "推后", x: "x [米]", y: "y [米]", heading: "朝向 [°]", add: "添加", hold_: "暂停队列", resume: "继续队列", left: "米剩余",
    active: "进行中", state_waiting: "等待", succeeded: "已到达", canceled: "已取消", failed: "失败",
    noAlarms: "没有报警", acknowledge: "确认", acknowledged: "已确认", over: "已结束", connection: "与机器人的连接中断", noLog: "暂无日志",
    controlMine: "您正在控制", controlNone: "无人控制", controlOther: "正在控制", takeOver: "接管", take: "取得控制", giveBack: "交还", theme: "深色或浅色", language: "English",
    silentSince: "无消息，始于", controlTaken: "已接管控制", controlOver: "控制已失效：未续期", watching: "仅观看", who: "您的姓名", name: "姓名", nameNote: "控制机器人或急停后，他人会看到此姓名。留空则使用令牌的名称。", keep: "保存",
    refused: "已拒绝", refusedOther: "正在控制：请先接管", refusedRole: "您的角色无权执行此操作", close: "关闭", token: "令牌", tokenAsked: "服务器要求令牌", tokenWrong: "服务器不认识此令牌，或错误次数过多：请等待一分钟。", tokenNote: "仅保留到关闭此标签页。", enter: "进入",
    topic: "话题", field: "字段", choose: "选择", noCamera: "没有相机", mapLabel: "厂房地图。方向键移动，加减号缩放；也可在任务面板输入目标。", sceneLabel: "机器人三维视图",
    hintGoal: "点击目的地，拖动设定朝向", hintPose: "点击机器人所在位置，拖动设定朝向", hintWaypoint: "点击添加到队列，拖动设定朝向", panels: "面板", tools: "地图工具", history: "步骤",
    robotQueue: "任务队列", robotQueueNote: "队列保存在机器人端，关闭本页面后仍继续执行。", noTasks: "没有任务。请添加任务，或选择“航点”后点击地图。", held: "队列已暂停", clearTasks: "全部取消", taskType: "任务", place: "地点", tote: "货箱", to: "目的地", dock: "充电桩", seconds: "秒",
    task_drive_to: "驶往", task_carry: "搬运", task_dock: "停靠", task_undock: "离开停靠", task_wait: "等待", task_waiting: "等待中", task_active: "进行中：", task_succeeded: "已完成", task_failed: "失败：", task_canceled: "已取消",
    unreached: "连接中断：此处的急停无法到达机器人，请使用机器人上的急停按钮。", display: "时间与显示",
    estimated: "二维位姿估计", begunAnew: "已从头开始", goesTo: "目标添加给：", "connection lost": "连接中断", "not connected": "未连接",
    simulation: "仿真", play: "继续", pause: "暂停", paused: "已暂停", step: "单步", fastest: "最快", reset: "重置", resetAsk: "重置仿真？", resetText: "仿真将从头开始，此前的记录将丢失。",
  },
};

export const LANGUAGES = Object.keys(WORDS);

/** Return what gives the words of a language. */
export function wordsOf(language) {
  return (key) => WORDS[language][key] ?? key;
}

const DAY_S = 1e8; // from here on a time is of the calendar

/** Return a time [s] as minutes and seconds, one of the calendar as the time of the day. */
export function clock(seconds) {
  if (seconds > DAY_S) return new Date(seconds * 1000).toTimeString().slice(0, 8);
  return seconds === null || seconds === undefined ? "–" : `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
}
