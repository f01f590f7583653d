// The panel: one robot's plan with its links, what it watches, and what happened. Texts are set as text only.

const SIGNS = { pending: "·", running: "▶", finished: "✓", dropped: "✗", superseded: "↺", failed: "!", cancelled: "■" };

function element(kind, text = "", className = "") {
  const made = document.createElement(kind);
  if (text) made.textContent = text;
  if (className) made.className = className;
  return made;
}

class Panel {
  constructor(run, jump) {
    this.run = run; this.jump = jump; this.shown = null; this.told = 0; this.times = [];
    this.parts = Object.fromEntries(["robot", "doing", "steps", "facts", "watched", "marks", "only"].map((id) => [id, document.getElementById(id)]));
    for (const robot of run.robots) this.parts.robot.append(new Option(robot, robot));
    this.parts.only.addEventListener("change", () => this.list());
  }

  get robot() { return this.parts.robot.value; }

  show(time) {
    const plan = this.run.plan(this.robot, time);
    const waits = this.run.waiting(this.robot, time).why;
    const doing = `${plan.action || (plan.steps.length ? "does nothing" : "has no plan yet")}${waits ? `, waits for ${waits}` : ""}`;
    if (this.parts.doing.textContent !== doing) this.parts.doing.textContent = doing;
    if (plan !== this.shown) { this.shown = plan; this.showPlan(plan); this.showWatch(plan.watch); }
    if (this.told !== this.run.marks.length) this.list();
    this.follow(time);
  }

  showPlan(plan) {
    const rows = plan.steps.map((step) => {
      const row = element("div", "", `step ${step.state}`);
      row.append(element("span", SIGNS[step.state], "mark"), element("span", step.name, "name"));
      if (step.why) row.append(element("span", `${step.when.toFixed(1)} s: ${step.why}`, "why"));
      row.title = `step ${step.id}, ${step.state}`;
      return row;
    });
    const goal = element("div", "goals", "step goal");
    this.parts.steps.replaceChildren(...rows, goal);
    this.drawLinks(plan, rows, goal);
    const running = rows.find((row) => row.classList.contains("running"));
    if (running) running.scrollIntoView({ block: "nearest" });
  }

  drawLinks(plan, rows, goal) {
    const NS = "http://www.w3.org/2000/svg", svg = document.createElementNS(NS, "svg");
    const place = new Map(plan.steps.map((step, index) => [step.id, rows[index]]));
    const middle = (row) => row.offsetTop + Math.min(11, row.offsetHeight / 2);
    for (const [producer, fact, consumer] of plan.links) {
      const from = place.get(producer), to = consumer === null ? goal : place.get(consumer);
      if (!from || !to) continue;
      const a = middle(from), b = middle(to), out = Math.max(6, 56 - 7 * Math.sqrt(Math.abs(b - a) / 4));
      const path = document.createElementNS(NS, "path");
      path.setAttribute("d", `M62 ${a} C ${out} ${a}, ${out} ${b}, 62 ${b}`);
      if (from.classList.contains("finished")) path.setAttribute("class", "past");
      const title = document.createElementNS(NS, "title");
      title.textContent = fact; path.append(title); svg.append(path);
    }
    svg.setAttribute("width", "64"); svg.setAttribute("height", String(goal.offsetTop + goal.offsetHeight));
    this.parts.steps.append(svg);
  }

  showWatch(watch) {
    this.parts.watched.textContent = watch === null ? "everything" : `${watch.length} facts`;
    this.parts.facts.replaceChildren(...(watch || []).map((fact) => element("span", fact, "fact")));
  }

  list() {
    const only = this.parts.only.checked ? this.robot : null;
    const marks = this.run.marks.filter((mark) => only === null || mark[2] === only);
    this.times = marks.map((mark) => mark[0]); this.told = this.run.marks.length; this.current = -2;
    this.parts.marks.replaceChildren(...marks.map(([t, kind, , text]) => {
      const item = element("li");
      item.tabIndex = 0;
      item.append(element("time", `${t.toFixed(1)} s`), element("span", text, kind));
      item.addEventListener("click", () => this.jump(t));
      item.addEventListener("keydown", (event) => { if (event.key === "Enter") this.jump(t); });
      return item;
    }));
  }

  follow(time) { // the events that have happened, the last of them marked
    const current = lastBefore(this.times, time + 1e-6), items = this.parts.marks.children;
    if (current === this.current) return;
    for (let i = 0; i < items.length; i++) {
      items[i].classList.toggle("future", i > current);
      items[i].classList.toggle("now", i === current);
    }
    this.current = current;
    if (current >= 0 && !this.parts.marks.contains(document.activeElement)) {
      const list = this.parts.marks.parentElement, item = items[current];
      list.scrollTop = item.offsetTop - list.offsetTop - list.clientHeight / 2;
    }
  }
}
