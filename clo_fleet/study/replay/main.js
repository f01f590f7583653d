// The page: time goes on, and whoever looks moves it.

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16, 32];

async function main() {
  const data = await unpacked(document.getElementById("data").textContent);
  const run = new Run(data.scene, data.run);
  if (data.piece) run.append(data.piece);
  const get = (id) => document.getElementById(id);
  const canvas = get("plan"), drawing = new Drawing(canvas, run), slider = get("time");
  const state = { time: 0, playing: Boolean(data.live), speed: 4, following: false, frames: 0, head: Boolean(data.live) };
  const jump = (time) => { state.time = Math.min(run.until, Math.max(0, time)); state.head = false; state.dirty = true; };
  const panel = new Panel(run, jump);
  document.documentElement.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  get("world").textContent = data.run.world;
  for (const speed of SPEEDS) get("speed").append(new Option(`${speed} ×`, String(speed)));
  get("speed").value = "4";

  const choose = (robot) => { get("robot").value = robot; drawing.chosen = robot; panel.shown = null; panel.told = -1; state.dirty = true; };
  const play = (on) => {
    if (on && state.time >= run.until && !data.live) state.time = 0;
    state.playing = on; get("play").textContent = on ? "pause" : "play";
  };
  const theme = () => {
    const root = document.documentElement;
    root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
    drawing.ground = null; state.dirty = true; ticks();
  };
  const fit = () => { drawing.fit(); state.following = false; state.dirty = true; };
  const next = (way) => {
    const times = run.marks.map((mark) => mark[0]);
    const found = way > 0 ? times.find((time) => time > state.time + 0.01) : times.filter((time) => time < state.time - 0.01).pop();
    if (found !== undefined) jump(found);
  };
  const faster = (way) => {
    const index = Math.min(SPEEDS.length - 1, Math.max(0, SPEEDS.indexOf(state.speed) + way));
    state.speed = SPEEDS[index]; get("speed").value = String(state.speed);
  };
  const other = (way) => {
    const index = run.robots.indexOf(panel.robot);
    choose(run.robots[(index + way + run.robots.length) % run.robots.length]);
  };
  const heading = () => {
    const [outcome, why] = run.outcome || ["", ""];
    get("run").textContent = `${data.run.strategy}, seed ${data.run.seed}${outcome ? `: ${outcome.replaceAll("_", " ")} (${why})` : data.live ? ": running" : ": cut short"}`;
  };

  function ticks() { // where something happened, above the slider
    const strip = get("ticks"), context = strip.getContext("2d"), ratio = window.devicePixelRatio || 1;
    strip.width = strip.clientWidth * ratio; strip.height = strip.clientHeight * ratio;
    const ink = { dropped: drawing.colour("good"), mended: drawing.colour("good"), failed: drawing.colour("bad"), disturbed: drawing.colour("bad") };
    for (const [t, kind] of run.marks) {
      context.fillStyle = ink[kind] || drawing.colour("faint");
      context.fillRect((strip.width * t) / (run.until || 1), ink[kind] ? 0 : strip.height / 3, Math.max(1, 1.5 * ratio), strip.height);
    }
  }

  get("play").addEventListener("click", () => play(!state.playing));
  get("fit").addEventListener("click", fit);
  get("theme").addEventListener("click", theme);
  get("help").addEventListener("click", () => { get("keys").hidden = !get("keys").hidden; });
  get("speed").addEventListener("change", (event) => { state.speed = Number(event.target.value); event.target.blur(); });
  get("robot").addEventListener("change", (event) => { choose(event.target.value); event.target.blur(); });
  slider.addEventListener("input", () => jump(Number(slider.value)));
  window.addEventListener("resize", () => { state.dirty = true; ticks(); });

  const keys = {
    " ": () => play(!state.playing), "[": () => next(-1), "]": () => next(1), "+": () => faster(1), "=": () => faster(1), "-": () => faster(-1),
    n: () => other(1), p: () => other(-1), 0: fit, t: theme, f: () => { state.following = !state.following; },
    "?": () => get("help").click(), Home: () => jump(0), End: () => jump(run.until),
  };
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const arrow = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (arrow) jump(state.time + arrow * (event.shiftKey ? 10 : 1));
    else if (keys[event.key] && !(event.key === " " && event.target.tagName === "BUTTON")) keys[event.key]();
    else return;
    event.preventDefault();
  });

  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    drawing.zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY); state.dirty = true;
  }, { passive: false });
  let drag = null;
  canvas.addEventListener("pointerdown", (event) => { drag = { x: event.offsetX, y: event.offsetY, far: 0 }; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (!drag) { drawing.pointer = [event.offsetX, event.offsetY]; state.dirty = true; return; }
    const dx = event.offsetX - drag.x, dy = event.offsetY - drag.y;
    drag.far += Math.hypot(dx, dy); Object.assign(drag, { x: event.offsetX, y: event.offsetY });
    if (drag.far > 4) { drawing.pan(dx, dy); state.following = false; state.dirty = true; }
  });
  canvas.addEventListener("pointerleave", () => { drawing.pointer = null; state.dirty = true; });
  canvas.addEventListener("pointerup", (event) => {
    const robot = drag && drag.far <= 4 ? drawing.nearest(event.offsetX, event.offsetY, state.time) : null;
    if (robot) choose(robot);
    drag = null;
  });

  async function listen() { // a run that goes on: fetch what has happened since
    for (let from = 0; !run.outcome;) {
      try {
        const piece = await (await fetch(`${data.live}?from=${from}`)).json();
        from = piece.next; run.append(piece);
        slider.max = String(run.until); heading(); ticks(); state.dirty = true;
      } catch (error) { get("run").textContent = `${data.run.strategy}: the server is gone`; return; }
      await new Promise((wake) => setTimeout(wake, 500));
    }
  }

  let before = performance.now();
  function frame(now) {
    const passed = Math.min(0.25, (now - before) / 1000);
    before = now;
    if (state.playing) {
      state.time = Math.min(run.until, state.time + passed * state.speed);
      if (state.head) state.time = Math.max(state.time, run.until - 2);
      if (state.time >= run.until && run.outcome) play(false);
      state.dirty = true;
    }
    if (state.dirty || canvas.clientWidth !== state.width || canvas.clientHeight !== state.height) {
      [state.dirty, state.width, state.height] = [false, canvas.clientWidth, canvas.clientHeight];
      const pose = state.following && run.pose(panel.robot, state.time);
      if (pose) drawing.centre(pose.x, pose.y);
      drawing.draw(state.time); panel.show(state.time);
      slider.value = String(state.time);
      get("clock").textContent = `${state.time.toFixed(1)} s of ${run.until.toFixed(1)} s`;
      state.frames++;
    }
    requestAnimationFrame(frame);
  }

  slider.max = String(run.until);
  if (run.robots.length) choose(run.robots[0]);
  heading(); ticks();
  if (data.live) { play(true); listen(); }
  window.replay = { run, state, drawing, jump }; // for whoever looks from the console, and for tests
  requestAnimationFrame(frame);
}

main().catch((error) => { document.body.textContent = `This page cannot be shown: ${error}`; });
