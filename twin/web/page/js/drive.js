/** Teleoperation with a dead man's switch: velocities go out only while a stick or key is held. */

import { html, useEffect, useRef, useState } from "ui";

const PERIOD_MS = 100;
const TURN = 1.2; // rad/s at full deflection
const KEYS = { w: [1, 0], s: [-1, 0], a: [0, 1], d: [0, -1], ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1] };

export function Drive({ station, t }) {
  const stick = useRef();
  const held = useRef({ keys: new Set(), pointer: null, timer: 0 });
  const [knob, setKnob] = useState([0, 0]); // forward, left; -1 to 1
  const [speed, setSpeed] = useState(0.5);
  const fastest = useRef(speed);
  fastest.current = speed;

  useEffect(() => {
    const state = held.current;
    const say = () => station.drive(state.command[0] * fastest.current, state.command[1] * TURN);
    const apply = () => {
      const keys = [...state.keys].map((key) => KEYS[key]);
      const sum = state.pointer ?? keys.reduce((all, key) => [all[0] + key[0], all[1] + key[1]], [0, 0]);
      const isHeld = state.pointer !== null || keys.length > 0;
      state.command = sum.map((value) => Math.max(-1, Math.min(1, value)));
      setKnob(state.command);
      if (isHeld && !state.timer) {
        state.timer = setInterval(say, PERIOD_MS);
        say();
      } else if (!isHeld && state.timer) {
        clearInterval(state.timer);
        state.timer = 0;
        station.drive(0, 0);
      }
    };
    const letGo = () => {
      state.keys.clear();
      state.pointer = null;
      apply();
    };
    const refused = ({ detail: topic }) => { // what was not obeyed needs no zero, which would be refused as well
      if (topic !== station.teleop?.topic) return;
      clearInterval(state.timer);
      state.timer = 0;
      letGo();
    };
    state.take = (pointer) => {
      state.pointer = pointer;
      apply();
    };
    const hidden = () => document.hidden && letGo();
    const typing = (target) => /^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName);
    const down = (event) => {
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      if (!KEYS[key] || typing(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
      if (key.startsWith("Arrow") && event.target !== stick.current) return; // they scroll elsewhere
      event.preventDefault();
      if (event.repeat && !state.keys.has(key)) return; // held since before it was refused
      state.keys.add(key);
      apply();
    };
    const up = (event) => {
      if (state.keys.delete(event.key.length === 1 ? event.key.toLowerCase() : event.key)) apply();
    };
    const listeners = [[window, "keydown", down], [window, "keyup", up], [window, "blur", letGo], [window, "pagehide", letGo], [document, "visibilitychange", hidden], [station.ros, "connection", letGo], [station, "refused", refused]];
    listeners.forEach(([target, name, call]) => target.addEventListener(name, call));
    return () => {
      letGo();
      listeners.forEach(([target, name, call]) => target.removeEventListener(name, call));
    };
  }, [station.selected]); // what is held was meant for the robot before

  const point = (event) => {
    const box = stick.current.getBoundingClientRect(), half = box.width / 2;
    const x = (event.clientX - box.left - half) / half, y = (event.clientY - box.top - half) / half;
    const far = Math.max(1, Math.hypot(x, y));
    held.current.take([-y / far, -x / far]);
  };
  if (!station.teleop) return html`<p class="muted">${t("noDrive")}</p>`;
  return html`
    <div class="drive">
      <div class="stick" ref=${stick} tabindex="0" role="application" aria-label=${t("joystick")}
        onPointerDown=${(event) => { stick.current.setPointerCapture(event.pointerId); point(event); }}
        onPointerMove=${(event) => held.current.pointer && point(event)}
        onPointerUp=${() => held.current.take(null)} onPointerCancel=${() => held.current.take(null)}
        onLostPointerCapture=${() => held.current.take(null)}>
        <div class="knob" style=${{ transform: `translate(${-knob[1] * 56}px, ${-knob[0] * 56}px)` }}></div>
      </div>
      <div class="drive-side">
        <p class="muted">${t("hold")}</p>
        <label>${t("maxSpeed")} <output>${speed.toFixed(1)} m/s</output>
          <input type="range" min="0.1" max="1" step="0.1" value=${speed} onInput=${(event) => setSpeed(Number(event.target.value))} />
        </label>
      </div>
    </div>`;
}
