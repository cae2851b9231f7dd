/** Client of rosbridge v2: topics, services and actions over one socket that is opened again when it closes. */

const AGAIN_MS = 1000;
const ABSENT_MS = 4000; // at most, until a server that does not answer is tried again
const REFUSED_MS = 30_000; // at most, while it asks for a token that nobody has entered
const WRONG_MS = 64_000; // after a wrong one: the server counts those of a minute, and at ten locks the address out
const REFUSED = 1008; // the close code of a policy
const CLOCK = ["/rosapi/get_time", "rosapi_msgs/srv/GetTime"]; // what any server answers, to any role

export class Rosbridge extends EventTarget {
  /**
   * @param {string} url of the server; ws: or wss:
   * @param {string} token that it may ask for; told in a first message, as a browser hides why an address was refused
   */
  constructor(url, token = "") {
    super();
    this.url = url;
    this.token = token;
    this.connected = false; // and let in
    this.refused = false; // for want of a token that the server knows
    this.wrong = ""; // the token that it did not know
    this.heard = 0; // performance.now() of the last message
    this._next = 0;
    this._topics = new Map(); // name -> {request, callbacks}
    this._adverts = new Map(); // name -> type
    this._waiting = new Map(); // id -> {resolve, reject, feedback}
    this._said = new Map(); // id of a publication -> what to call if it is refused
    this._wait = 0;
    this._open();
  }

  /** Try another token, at once. */
  enter(token) {
    this.token = token;
    clearTimeout(this._again);
    this._closed();
    this._wait = 0;
    const before = this._socket;
    this._open(); // of two sockets only the newer counts
    before.close();
  }

  _open() {
    const socket = new WebSocket(this.url);
    this._socket = socket;
    socket.onopen = () => {
      if (socket !== this._socket) return;
      if (this.token) this._send({ op: "auth", token: this.token });
      this.call(...CLOCK).catch(() => {}); // whatever comes back: who answers has let us in
    };
    socket.onmessage = (event) => {
      if (socket !== this._socket) return;
      if (!this.connected) this._begin();
      this._receive(JSON.parse(event.data));
    };
    socket.onclose = ({ code }) => {
      if (socket !== this._socket) return;
      const most = this.connected ? AGAIN_MS : code !== REFUSED ? ABSENT_MS : this.token ? WRONG_MS : REFUSED_MS;
      this._wait = this.connected ? AGAIN_MS : Math.min(most, Math.max(AGAIN_MS, 2 * this._wait));
      this.refused = !this.connected && code === REFUSED;
      if (this.refused) this.wrong = this.token;
      this._closed();
      this._again = setTimeout(() => this._open(), this._wait);
    };
  }

  _begin() {
    this.connected = true;
    this.refused = false;
    this._wait = 0;
    this._topics.forEach((topic) => this._send(topic.request));
    this._adverts.forEach((type, topic) => this._advertise(topic, type));
    this._tell("connection");
  }

  _closed() {
    this.connected = false;
    this._waiting.forEach(({ reject }) => reject(new Error("connection lost")));
    this._waiting.clear();
    this._said.clear();
    this._tell("connection");
  }

  _advertise(topic, type) {
    this._send({ op: "advertise", id: `publish:${topic}`, topic, type });
  }

  _tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  _send(message) {
    if (this._socket.readyState !== WebSocket.OPEN) return false;
    this._socket.send(JSON.stringify(message));
    return true;
  }

  _receive(message) {
    this.heard = performance.now();
    if (message.op === "publish") {
      const topic = this._topics.get(message.topic);
      if (topic) topic.last = message.msg;
      topic?.callbacks.forEach((callback) => callback(message.msg));
      return;
    }
    if (message.op === "status") {
      this._said.get(message.id)?.(new Error(message.msg));
      const topic = /^publish:([^#]*)/.exec(message.id)?.[1];
      if (topic && message.level === "error") this._tell("refused", { topic, why: message.msg });
      this._tell("status", message);
      return;
    }
    const waiting = this._waiting.get(message.id);
    if (!waiting) return;
    if (message.op === "action_feedback") {
      waiting.feedback?.(message.values);
      return;
    }
    this._waiting.delete(message.id);
    if (message.op === "service_response" && !message.result) waiting.reject(new Error(String(message.values)));
    else waiting.resolve(message.op === "service_response" ? message.values : message);
  }

  /** Forget what topics said last: it is not true any more. */
  forget() {
    this._topics.forEach((topic) => delete topic.last);
  }

  /**
   * Hear a topic; returns a function that ends it. `throttle` is the least time between messages [ms].
   * Who is not the first to hear it is given the last message: the server sends that to the first only.
   */
  subscribe(topic, type, callback, throttle = 0) {
    let known = this._topics.get(topic);
    if (!known) {
      const request = { op: "subscribe", id: `subscribe:${topic}`, topic, type, throttle_rate: throttle, queue_length: throttle ? 1 : 0 };
      known = { request, callbacks: new Set() };
      this._topics.set(topic, known);
      this._send(request);
    }
    known.callbacks.add(callback);
    if (known.last !== undefined) queueMicrotask(() => known.last !== undefined && known.callbacks.has(callback) && callback(known.last));
    return () => {
      known.callbacks.delete(callback);
      if (known.callbacks.size || this._topics.get(topic) !== known) return;
      this._topics.delete(topic);
      this._send({ op: "unsubscribe", id: known.request.id, topic });
    };
  }

  /** Say something on a topic; returns whether it was sent: nothing waits for a connection. What is refused becomes an event. */
  publish(topic, type, msg, id = `publish:${topic}`) {
    if (this._adverts.get(topic) !== type) {
      this._adverts.set(topic, type);
      this._advertise(topic, type);
    }
    return this._send({ op: "publish", id, topic, msg });
  }

  /** Say something on a topic; rejects if that is refused: nothing answers a publication, but what is asked after it. */
  async say(topic, type, msg) {
    const id = `publish:${topic}#${++this._next}`;
    const refused = new Promise((_, reject) => this._said.set(id, reject));
    this.publish(topic, type, msg, id);
    try {
      await Promise.race([refused, this.call(...CLOCK)]);
    } finally {
      this._said.delete(id);
    }
  }

  /** Call a service; resolves to the fields of its response. */
  call(service, type, args = {}) {
    return this._ask({ op: "call_service", service, type, args }).result;
  }

  /** Send a goal; `result` resolves to the action's result with its `status`. */
  goal(action, actionType, args, feedback) {
    const { id, result } = this._ask({ op: "send_action_goal", action, action_type: actionType, args, feedback: true }, feedback);
    return { result, cancel: () => this._send({ op: "cancel_action_goal", id, action }) };
  }

  _ask(message, feedback) {
    const id = `page:${++this._next}`;
    const result = new Promise((resolve, reject) => {
      if (this._send({ ...message, id })) this._waiting.set(id, { resolve, reject, feedback });
      else reject(new Error("not connected"));
    });
    return { id, result };
  }
}
