// The building and what moves in it, on a canvas. The building is drawn once for each view and then copied.

const PALETTE = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#e69f00", "#4b4b9b"]; // after Okabe and Ito
const SHOWN = 4; // [s] for which a help stays in sight

class Drawing {
  constructor(canvas, run) {
    this.canvas = canvas; this.run = run; this.view = null; this.ground = null; this.chosen = null; this.pointer = null;
    const points = [
      ...run.scene.rooms.flatMap((room) => room.outline), ...run.scene.corridors.flatMap((corridor) => corridor.shape),
    ];
    const xs = points.map((point) => point[0]), ys = points.map((point) => point[1]);
    const least = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);
    const most = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);
    this.box = points.length ? [least(xs), least(ys), most(xs), most(ys)] : [0, 0, 1, 1];
    this.colours = new Map(run.robots.map((robot, index) => [robot, PALETTE[index % PALETTE.length]]));
  }

  resize() {
    const ratio = window.devicePixelRatio || 1, { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio); this.canvas.height = Math.round(height * ratio);
      this.ground = null;
      if (!this.view || this.fitted) this.fit();
    }
    this.ratio = ratio;
  }

  fit() {
    const [x0, y0, x1, y1] = this.box, { clientWidth: width, clientHeight: height } = this.canvas;
    const scale = Math.min((width - 48) / (x1 - x0 || 1), (height - 96) / (y1 - y0 || 1));
    this.view = { scale, x: (x0 + x1) / 2, y: (y0 + y1) / 2 };
    this.fitted = true; this.ground = null;
  }

  zoom(factor, px, py) { // about a point of the canvas
    const before = this.world(px, py), view = this.view;
    view.scale = Math.min(400, Math.max(0.5, view.scale * factor));
    const after = this.world(px, py);
    view.x += before[0] - after[0]; view.y += before[1] - after[1];
    this.fitted = false; this.ground = null;
  }

  pan(dx, dy) { this.view.x -= dx / this.view.scale; this.view.y += dy / this.view.scale; this.fitted = false; this.ground = null; }

  centre(x, y) { Object.assign(this.view, { x, y }); this.fitted = false; this.ground = null; }

  world(px, py) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return [this.view.x + (px - width / 2) / this.view.scale, this.view.y - (py - height / 2) / this.view.scale];
  }

  at(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return [width / 2 + (x - this.view.x) * this.view.scale, height / 2 - (y - this.view.y) * this.view.scale];
  }

  nearest(px, py, time) { // the robot at a point of the canvas
    let best = null, least = 24;
    for (const robot of this.run.robots) {
      const pose = this.run.pose(robot, time);
      if (!pose) continue;
      const [x, y] = this.at(pose.x, pose.y), away = Math.hypot(x - px, y - py);
      if (away < least) [best, least] = [robot, away];
    }
    return best;
  }

  draw(time) {
    this.resize();
    const context = this.canvas.getContext("2d");
    if (!this.ground) this.ground = this.drawGround();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.ground, 0, 0);
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    this.poses = new Map();
    for (const robot of this.run.robots) { const pose = this.run.pose(robot, time); if (pose) this.poses.set(robot, pose); }
    this.drawObjects(context, time);
    this.drawRobots(context, time);
    this.drawWaits(context, time);
    this.drawHelps(context, time);
    if (this.pointed) this.drawState(context, this.pointed);
  }

  colour(name) { return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim(); }

  drawGround() {
    const ground = document.createElement("canvas");
    ground.width = this.canvas.width; ground.height = this.canvas.height;
    const context = ground.getContext("2d"), { scene } = this.run, scale = this.view.scale;
    const names = ["ground", "room", "wall", "corridor", "obstacle", "text", "faint", "panel", "accent", "good", "line"];
    this.ink = Object.fromEntries(names.map((name) => [name, this.colour(name)]));
    context.setTransform(this.ratio || 1, 0, 0, this.ratio || 1, 0, 0);
    context.fillStyle = this.ink.ground; context.fillRect(0, 0, ground.width, ground.height);
    context.lineCap = "round"; context.lineJoin = "round";
    for (const corridor of scene.corridors) {
      this.trace(context, corridor.shape);
      context.strokeStyle = this.ink.corridor; context.lineWidth = Math.max(1.5, scale * (corridor.single_lane ? 0.75 : 1.4));
      context.stroke();
    }
    for (const corridor of scene.corridors.filter((one) => one.single_lane || one.one_way)) {
      this.trace(context, corridor.shape);
      context.setLineDash(corridor.one_way ? [8, 6] : [1, 5]);
      context.strokeStyle = this.ink.obstacle; context.lineWidth = 1; context.stroke(); context.setLineDash([]);
    }
    for (const room of scene.rooms) {
      this.trace(context, room.outline, true);
      context.fillStyle = this.ink.room; context.fill();
      for (const obstacle of room.obstacles) { this.trace(context, obstacle, true); context.fillStyle = this.ink.obstacle; context.fill(); }
      this.trace(context, room.outline, true);
      context.strokeStyle = this.ink.wall; context.lineWidth = Math.max(1, Math.min(3, 0.12 * scale)); context.stroke();
    }
    for (const door of scene.doors) {
      const dx = -Math.sin(door.heading) * door.width / 2, dy = Math.cos(door.heading) * door.width / 2, [x, y] = door.position;
      this.trace(context, [[x - dx, y - dy], [x + dx, y + dy]]);
      context.lineCap = "butt"; context.strokeStyle = this.ink.room; context.lineWidth = Math.max(2.5, Math.min(6, 0.25 * scale)); context.stroke();
    }
    context.fillStyle = this.ink.faint; context.textAlign = "center"; context.textBaseline = "middle"; context.font = "12px system-ui, sans-serif";
    for (const room of scene.rooms) {
      const xs = room.outline.map((point) => point[0]), ys = room.outline.map((point) => point[1]);
      const width = (Math.max(...xs) - Math.min(...xs)) * scale;
      if (context.measureText(room.id).width > width - 4) continue;
      const [x, y] = this.at((Math.max(...xs) + Math.min(...xs)) / 2, Math.max(...ys));
      context.fillText(room.id, x, y + 11);
    }
    return ground;
  }

  trace(context, points, closed = false) {
    context.beginPath();
    points.forEach(([x, y], index) => { const at = this.at(x, y); if (index) context.lineTo(...at); else context.moveTo(...at); });
    if (closed) context.closePath();
  }

  drawObjects(context, time) {
    const seats = new Map(), scale = this.view.scale;
    this.pointed = null;
    context.font = "11px system-ui, sans-serif"; context.textAlign = "left"; context.textBaseline = "middle";
    for (const item of this.run.scene.objects) {
      const state = this.run.object(item, time);
      let pose = this.run.pose(item.id, time);
      if (state.held && this.poses.has(state.held)) {
        const seat = seats.get(state.held) || 0, carrier = this.poses.get(state.held);
        seats.set(state.held, seat + 1);
        pose = { x: carrier.x + 0.42 * Math.cos(2.1 * seat), y: carrier.y + 0.42 * Math.sin(2.1 * seat) };
      }
      if (!pose) continue;
      const [x, y] = this.at(pose.x, pose.y), half = Math.max(3.5, 1.4 * item.radius * scale);
      context.beginPath(); context.rect(x - half, y - half, 2 * half, 2 * half);
      context.fillStyle = state.facts.size > (item.prepared ? 0 : item.facts.length) ? this.ink.text : this.ink.panel; context.fill();
      context.strokeStyle = this.ink.text; context.lineWidth = 1.4; context.stroke();
      if (this.pointer && Math.hypot(x - this.pointer[0], y - this.pointer[1]) < half + 4) this.pointed = { item, state, x, y };
      if (scale > 11 && !state.held) { context.fillStyle = this.ink.faint; context.fillText(item.id, x + half + 3, y); }
    }
  }

  drawRobots(context, time) {
    const scale = this.view.scale;
    context.textAlign = "center"; context.textBaseline = "middle";
    for (const robot of this.run.scene.robots) {
      const pose = this.poses.get(robot.id);
      if (!pose) continue;
      const [x, y] = this.at(pose.x, pose.y), radius = Math.max(5, robot.radius * scale);
      if (robot.id === this.chosen) {
        context.beginPath(); context.arc(x, y, radius + 4, 0, 7); context.strokeStyle = this.ink.text; context.lineWidth = 2; context.stroke();
      }
      context.beginPath(); context.arc(x, y, radius, 0, 7);
      context.fillStyle = this.colours.get(robot.id); context.fill();
      context.strokeStyle = this.ink.panel; context.lineWidth = 1; context.stroke();
      context.beginPath(); context.moveTo(x, y); context.lineTo(x + radius * Math.cos(pose.h), y - radius * Math.sin(pose.h));
      context.lineWidth = 2; context.stroke();
      if (scale > 6 || robot.id === this.chosen) this.label(context, robot.id, x, y - radius - 9);
    }
  }

  label(context, text, x, y, ink = this.ink.text) {
    context.font = "600 12px system-ui, sans-serif";
    const width = context.measureText(text).width + 6;
    context.globalAlpha = 0.8; context.fillStyle = this.ink.panel; context.fillRect(x - width / 2, y - 8, width, 16); context.globalAlpha = 1;
    context.fillStyle = ink; context.fillText(text, x, y);
  }

  drawState(context, { item, state, x, y }) { // what is true of the object under the pointer
    const lines = [item.id, ...(state.held ? [`held by ${state.held}`] : []), ...state.facts];
    lines.forEach((line, index) => this.label(context, line, x, y + 16 * (index - lines.length) - 4));
  }

  drawWaits(context, time) { // who waits for whom: a dashed arrow
    context.setLineDash([4, 4]); context.strokeStyle = this.ink.text; context.lineWidth = 1.5;
    for (const robot of this.run.robots) {
      const here = this.poses.get(robot);
      for (const other of here ? this.run.waiting(robot, time).on : []) {
        const there = this.poses.get(other);
        if (there) this.arrow(context, this.at(here.x, here.y), this.at(there.x, there.y), 0);
      }
    }
    context.setLineDash([]);
  }

  drawHelps(context, time) {
    const ended = upTo(this.run.helps, time);
    for (let i = ended - 1; i >= 0 && time - this.run.helps[i][0] < SHOWN; i--) {
      const [t, by, robot, fact] = this.run.helps[i], from = this.run.pose(by, time), to = this.poses.get(robot);
      if (!from || !to) continue;
      const a = this.at(from.x, from.y), b = this.at(to.x, to.y);
      context.globalAlpha = Math.min(1, (SHOWN - time + t) / 1.5); context.strokeStyle = this.ink.good; context.lineWidth = 3;
      this.arrow(context, a, b, 0.18);
      this.label(context, `${by} helps ${robot}: ${fact}`, (a[0] + b[0]) / 2, (a[1] + b[1]) / 2 - 14, this.ink.good);
      context.globalAlpha = 1;
    }
  }

  arrow(context, [x0, y0], [x1, y1], bend) {
    const dx = x1 - x0, dy = y1 - y0, length = Math.hypot(dx, dy);
    if (length < 12) return;
    const cx = (x0 + x1) / 2 + bend * dy, cy = (y0 + y1) / 2 - bend * dx;
    const way = Math.atan2(y1 - cy, x1 - cx), tipX = x1 - 8 * Math.cos(way), tipY = y1 - 8 * Math.sin(way);
    context.beginPath(); context.moveTo(x0, y0); context.quadraticCurveTo(cx, cy, tipX, tipY); context.stroke();
    context.beginPath(); context.moveTo(tipX, tipY);
    for (const side of [0.45, -0.45]) context.lineTo(tipX - 9 * Math.cos(way + side), tipY - 9 * Math.sin(way + side));
    context.closePath(); context.fillStyle = context.strokeStyle; context.fill();
  }
}
