"use strict";
// What is known of the run, and what of it holds at a time. Nothing here draws.

const HOLD = 1.05; // [s] a body moves for at most so long before a sample: earlier it stood

class Body {
  constructor() { this.t = []; this.x = []; this.y = []; this.h = []; this.at = 0; }

  append(text) { // samples as recording.py writes them
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const last = [0, 0, 0, 0];
    let position = 0;
    const next = () => {
      let value = 0, factor = 1, byte;
      do { byte = bytes[position++]; value += (byte & 127) * factor; factor *= 128; } while (byte & 128);
      return value % 2 ? -(value + 1) / 2 : value / 2;
    };
    while (position < bytes.length) {
      for (let i = 0; i < 4; i++) last[i] += next();
      this.t.push(last[0] / 10); this.x.push(last[1] / 100);
      this.y.push(last[2] / 100); this.h.push(last[3] / 100);
    }
  }

  pose(time) { // {x, y, h}, or null before it is first seen
    const t = this.t;
    if (!t.length || time < t[0]) return null;
    let i = Math.min(this.at, t.length - 1);
    if (t[i] > time || (i + 2 < t.length && t[i + 2] <= time)) i = lastBefore(t, time);
    while (i + 1 < t.length && t[i + 1] <= time) i++;
    this.at = i;
    if (i + 1 === t.length) return { x: this.x[i], y: this.y[i], h: this.h[i] };
    const begin = Math.max(t[i], t[i + 1] - HOLD);
    const share = Math.max(0, (time - begin) / (t[i + 1] - begin || 1));
    let turn = this.h[i + 1] - this.h[i];
    turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI));
    return {
      x: this.x[i] + share * (this.x[i + 1] - this.x[i]),
      y: this.y[i] + share * (this.y[i + 1] - this.y[i]),
      h: this.h[i] + share * turn,
    };
  }
}

function lastBefore(times, time) { // index of the last one that is not later; -1 without one
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1; else high = middle;
  }
  return low - 1;
}

function upTo(entries, time) { // how many entries [t, ...] are not later
  let low = 0, high = entries.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (entries[middle][0] <= time) low = middle + 1; else high = middle;
  }
  return low;
}

class Run {
  constructor(scene, run) {
    this.scene = scene; this.run = run; this.until = 0; this.outcome = null;
    this.robots = scene.robots.map((robot) => robot.id);
    this.bodies = new Map(); this.plans = new Map(); this.objects = new Map(); this.waits = new Map();
    this.helps = []; this.marks = [];
    this.effects = new Set(scene.effects); this.holding = new Map(Object.entries(scene.holding));
    for (const item of scene.objects) this.objects.set(item.id, []);
    this.cache = new Map();
  }

  append(piece) {
    for (const [name, samples] of Object.entries(piece.tracks)) this.of(this.bodies, name, () => new Body()).append(samples);
    for (const [t, fact, value] of piece.facts) this.note(t, fact, value);
    for (const part of ["plans", "waits"])
      for (const [name, entries] of Object.entries(piece[part])) this.of(this[part], name, () => []).push(...entries);
    this.helps.push(...piece.helps); this.marks.push(...piece.marks);
    this.until = Math.max(this.until, piece.until); this.outcome = piece.outcome || this.outcome;
  }

  note(t, fact, value) { // [t, fact, value, robot or null] for each object that a fact is about
    const words = fact.slice(1, -1).split(" "), order = this.holding.get(words[0]);
    if (order) this.objects.get(words[order[1]])?.push([t, fact, value, words[order[0]]]);
    else if (this.effects.has(words[0])) for (const word of words.slice(1)) this.objects.get(word)?.push([t, fact, value, null]);
  }

  of(map, name, make) { if (!map.has(name)) map.set(name, make()); return map.get(name); }

  pose(name, time) { const body = this.bodies.get(name); return body ? body.pose(time) : null; }

  object(item, time) { // {facts: what has been done to it, held: by which robot, or null}
    const entries = this.objects.get(item.id), state = { facts: new Set(item.facts), held: null };
    for (let i = 0, n = upTo(entries, time); i < n; i++) {
      const [, fact, value, robot] = entries[i];
      if (!robot) state.facts[value ? "add" : "delete"](fact);
      else if (value) state.held = robot;
      else if (state.held === robot) state.held = null; // not if the next one has it already
    }
    return state;
  }

  waiting(robot, time) { // {why, on}: why it waits, or "", and for which robots
    const entries = this.waits.get(robot) || [], n = upTo(entries, time);
    return n ? { why: entries[n - 1][1], on: entries[n - 1][2] } : { why: "", on: [] };
  }

  plan(robot, time) { // {steps: [{id, name, state, when, why}], links, watch, action}; the same object until it changes
    const entries = this.plans.get(robot) || [], n = upTo(entries, time), key = `${robot} ${n}`;
    if (!this.cache.has(key)) {
      if (this.cache.size > 500) this.cache.clear();
      this.cache.set(key, planAfter(entries.slice(0, n)));
    }
    return this.cache.get(key);
  }
}

function planAfter(entries) {
  const known = new Map();
  let order = [], links = [], watch = [], action = "";
  const put = ([id, name]) => { if (!known.has(id)) known.set(id, { id, name, state: "pending", when: 0, why: "" }); return id; };
  const settle = (id, state, when, why) => { const step = known.get(id); if (step) Object.assign(step, { state, when, why }); };
  const settled = (id) => !["pending", "running"].includes(known.get(id).state);
  for (const [t, what, ...more] of entries) {
    if (what === "followed") {
      for (const id of order) if (!settled(id)) settle(id, "superseded", t, "another plan took its place");
      order = [...order.filter(settled), ...more[0].map(put)];
    } else if (what === "mended") {
      const next = more[0].map(put), gone = order.filter((id) => !settled(id) && !next.includes(id));
      for (const id of gone) settle(id, "dropped", t, `mended: ${more[1]}`);
      order = [...order.filter(settled), ...next.filter((id) => !settled(id))];
    } else if (what === "dropped") {
      for (const id of more[0]) settle(id, "dropped", t, more[1]);
    } else if (what === "linked") {
      [links, watch] = more;
    } else if (what === "started") {
      settle(more[0], "running", t, ""); action = more[1];
    } else { // finished, failed, cancelled
      const step = known.get(more[0]);
      if (step && step.state !== "dropped") settle(more[0], what, t, more[1]);
      action = "";
    }
  }
  return { steps: order.map((id) => known.get(id)), links, watch, action };
}

async function unpacked(text) { // base64 of gzipped JSON
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return JSON.parse(await new Response(stream).text());
}
