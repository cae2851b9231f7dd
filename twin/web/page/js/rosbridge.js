/** Client of rosbridge v2: topics, services and actions over one socket that is opened again when it closes. */

const AGAIN_MS = 1000;

export class Rosbridge extends EventTarget {
  /** @param {string} url of the server; ws: or wss: */
  constructor(url) {
    super();
    this.url = url;
    this.connected = false;
    this.heard = 0; // performance.now() of the last message
    this._next = 0;
    this._topics = new Map(); // name -> {request, callbacks}
    this._adverts = new Map(); // name -> type
    this._waiting = new Map(); // id -> {resolve, reject, feedback}
    this._open();
  }

  _open() {
    const socket = new WebSocket(this.url);
    this._socket = socket;
    socket.onopen = () => {
      this.connected = true;
      this._topics.forEach((topic) => this._send(topic.request));
      this._adverts.forEach((type, topic) => this._send({ op: "advertise", topic, type }));
      this._tell("connection");
    };
    socket.onmessage = (event) => this._receive(JSON.parse(event.data));
    socket.onclose = () => {
      this.connected = false;
      this._waiting.forEach(({ reject }) => reject(new Error("connection lost")));
      this._waiting.clear();
      this._tell("connection");
      setTimeout(() => this._open(), AGAIN_MS);
    };
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

  /** Say something on a topic; returns whether it was sent: nothing waits for a connection. */
  publish(topic, type, msg) {
    if (this._adverts.get(topic) !== type) {
      this._adverts.set(topic, type);
      this._send({ op: "advertise", topic, type });
    }
    return this._send({ op: "publish", topic, msg });
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
