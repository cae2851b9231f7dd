/** Alarms: raised, repeated, over, acknowledged. What this tab has acknowledged stays so when the page is loaded again. */

const AGAIN_S = 10; // what is said again after a longer silence is a new alarm
const KEPT = 200;
const KEY = "twin.acknowledged";

/** A text in the words that `t` has: what the page says itself is a function of them, what others say is as it is. */
export const said = (text, t) => (typeof text === "function" ? text(t) : text);

const plain = (text) => said(text, (word) => word);

export class Alarms extends Map { // key -> {key, level, text, time, active, acknowledged}
  constructor() {
    super();
    try {
      this._known = JSON.parse(sessionStorage.getItem(KEY)) ?? [];
    } catch {
      this._known = [];
    }
  }

  /**
   * Raise an alarm, or end one; returns whether anything is different.
   * One with `isEvent` is of a moment and never ends: the same a while later is another.
   */
  raise(key, level, text, { active = true, time = null, isEvent = false } = {}) {
    const known = this.get(key);
    if (!active && !known?.active) return false;
    if (!active) {
      known.active = false;
      this._remember(known, () => null);
      return true;
    }
    const isSame = known?.active && plain(known.text) === plain(text) && known.level === level;
    if (isSame && !(isEvent && Math.abs(time - known.last) > AGAIN_S)) {
      known.last = time;
      if (known.acknowledged) this._remember(known, (span) => span && { ...span, to: Math.max(span.to, time) });
      return true;
    }
    const alarm = { key, level, text, time, last: time, active, isEvent };
    this.set(key, { ...alarm, acknowledged: this._span(alarm) !== undefined });
    return true;
  }

  acknowledge(key) {
    const alarm = this.get(key);
    if (!alarm?.active) return this.delete(key);
    alarm.acknowledged = true;
    // A stop that is still pressed is told anew to who loads the page anew.
    if (!key.startsWith("guard ")) this._remember(alarm, () => ({ id: idOf(alarm), from: alarm.time, to: alarm.last }));
    return true;
  }

  _span(alarm) {
    return this._known.find(({ id, from, to }) => id === idOf(alarm) && (!alarm.isEvent || (alarm.time >= from - AGAIN_S && alarm.time <= to + AGAIN_S)));
  }

  _remember(alarm, change) {
    const before = this._span({ ...alarm, time: alarm.isEvent ? alarm.time : null }), after = change(before);
    if (!before && !after) return;
    this._known = [...this._known.filter((each) => each !== before), ...(after ? [after] : [])].slice(-KEPT);
    try {
      sessionStorage.setItem(KEY, JSON.stringify(this._known));
    } catch { /* private browsing without storage: for this page only */ }
  }
}

const idOf = ({ key, text }) => `${key}: ${plain(text)}`;
