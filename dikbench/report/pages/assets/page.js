// Glue between the controls, Vega's charts and viser's replays: what is computed is declared in Python.
const $ = (id) => document.getElementById(id);
const digits = (value, most = 3) => (value == null ? "" : Number(value.toPrecision(most)));
const percent = (value) => (100 * value).toFixed(1);
const later = (milliseconds) => new Promise((go) => setTimeout(go, milliseconds));
const page = JSON.parse($("page-data")?.textContent ?? "null");

function button(text, act) {
  const made = Object.assign(document.createElement("button"), { type: "button", textContent: text });
  made.addEventListener("click", act);
  return made;
}

// Fill a table: the second cell of a row is its heading, texts stand left.
function fill(table, rows) {
  table.tBodies[0].replaceChildren(...rows.map((cells) => {
    const line = document.createElement("tr");
    cells.forEach((content, place) => {
      const cell = document.createElement(place === 1 ? "th" : "td");
      if (!/^[-\d.]*$/.test(content)) cell.className = "name";
      cell.append(content);
      line.append(cell);
    });
    return line;
  }));
}

// A heading of a sortable table is a button that sorts its rows: numbers first, what is empty last.
for (const heading of document.querySelectorAll("table.sortable > thead th")) {
  const sort = button("", () => {
    const table = heading.closest("table"), rises = heading.getAttribute("aria-sort") !== "ascending";
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", rises ? "ascending" : "descending");
    const rows = Array.from(table.tBodies[0].rows, (row) => {
      const cell = row.cells[heading.cellIndex], text = (cell.dataset.sort ?? cell.textContent).trim();
      return [row, text === "" ? 2 : Number.isNaN(parseFloat(text)) ? 1 : 0, text];
    });
    const compare = (a, b) => (a[1] ? a[2].localeCompare(b[2]) : parseFloat(a[2]) - parseFloat(b[2])) * (rises ? 1 : -1);
    rows.sort((a, b) => a[1] - b[1] || (a[1] < 2 ? compare(a, b) : 0));
    table.tBodies[0].append(...rows.map(([row]) => row));
  });
  sort.append(...heading.childNodes);
  heading.append(sort);
}

// A row of the tables below stays where every word of the filter occurs in its names.
$("filter").addEventListener("input", () => {
  const words = $("filter").value.toLowerCase().split(/\s+/).filter(Boolean);
  const rows = [...document.querySelectorAll("section:not(#play) table.sortable > tbody > tr")];
  for (const row of rows) {
    const names = Array.from(row.querySelectorAll(".name"), (cell) => cell.textContent).join(" ").toLowerCase();
    row.hidden = !words.every((word) => names.includes(word));
  }
  const left = rows.filter((row) => !row.hidden).length;
  $("rows-shown").textContent = words.length ? `${left} of ${rows.length} rows` : "";
});
$("filtering").addEventListener("submit", (event) => event.preventDefault());
$("filtering").hidden = false;

async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return JSON.parse(await new Response(stream).text());
}

async function play() {
  const asked = [...page.controls, ...page.phase], initial = {}, linked = new URLSearchParams(location.hash.slice(1));
  for (const name of asked) {
    initial[name] = $(name).value;
    if (linked.has(name)) $(name).value = linked.get(name);
    if (!$(name).value) $(name).value = initial[name];
  }
  const columns = Object.entries(await inflated(page.columns));
  const value = ({ words, values }, k) => (words ? words[values[k]] : values[k]);
  const all = columns[0][1].values.map((_, k) =>
    Object.fromEntries(columns.map(([name, column]) => [name, value(column, k)])));
  page.specification.data.find((each) => each.name === page.rows).values = all;
  page.trial = new Map(all.map((row) => [row.id, row]));
  $("play").hidden = false;
  const options = { mode: "vega", renderer: "svg", actions: false };
  const { view } = await vegaEmbed("#charts", page.specification, options);
  const known = (name) => (page.trial.has(linked.get(name)) ? linked.get(name) : "");
  const shown = { trial: known("trial"), beside: known("beside") };
  const update = async () => {
    await view.runAsync();
    for (const slider of document.querySelectorAll("#controls input"))
      slider.previousElementSibling.value = slider.dataset.texts.split("|")[slider.value];
    const rows = view.data(page.ranking).toSorted((a, b) => a.rank - b.rank || a.contender.localeCompare(b.contender));
    fill($("ranking"), rows.map((row) => [row.place ?? "", row.contender, percent(row.rate),
      percent(row.difference), `${percent(row.lower)} to ${percent(row.upper)}`, row.apart, row.trials,
      button("show", () => list(row.contender, {}))]));
    const named = (some) => some.slice(0, 5).map((row) => `${row.contender} (${percent(row.rate)} %)`).join(", ")
      + (some.length > 5 ? ` and ${some.length - 5} more` : "");
    const best = rows.filter((row) => row.place === 1), near = rows.filter((row) => row.place > 1 && row.tied);
    $("leading").textContent = !rows.length ? "No trial is left: choose less." : !rows[0].enough ? page.fewest
      : !best.length ? "In this view nobody ran every trial and succeeded." : `In this view${
        $("limits").value === "broken" ? ", limits kept or not," : ""} ${named(best)} succeed${
        best.length > 1 ? "" : "s"} most often; ${$("versus").value !== "best" ? `differences are to ${$("versus").value}`
        : near.length ? `not told apart: ${named(near)}` : "all others are told apart"}.`;
    $("sample").textContent = rows.length ? `${rows[0].contenders} formulations, ${Math.max(...rows.map((row) => row.trials))
      } trials each, ${rows[0].count} scenarios` : "";
    const state = asked.filter((name) => $(name).value !== initial[name]).map((name) => [name, $(name).value]);
    state.push(...Object.entries(shown).filter(([, id]) => id));
    if (state.length || location.hash.includes("=")) history.replaceState(null, "", `#${new URLSearchParams(state)}`);
  };
  const open = async (trial, beside) => {
    Object.assign(shown, { trial, beside });
    await Promise.all([update(), opened(trial, beside, (other) => open(trial, other))]);
  };
  const list = async (contender, { situation = "", category }) => {
    await view.signal("picked", contender).runAsync();
    const rows = view.data(page.trials).toSorted((a, b) => b.category - a.category || b.farthest - a.farthest)
      .filter((row) => [row.situation, ""].includes(situation) && [row.category, undefined].includes(category));
    const show = (most) => fill($("trials").querySelector("table"), rows.slice(0, most).map((row) => [
      page.outcomes[row.category], row.scenario, row.seed, row.reference, ...[row.farthest, row.error, row.peak].map(
        (each) => digits(each)), button(row.id, () => open(row.id, "")), page.runs[row.id] ? "\u25B6" : ""]));
    show(($("all-trials").checked = false) || 12);
    $("all-trials").onchange = ({ target }) => show(target.checked ? Infinity : 12);
    $("trials-title").textContent = `${contender}${situation && `, ${situation}`}: ${rows.length} trials, the worst first`;
    $("trials").hidden = false;
    $("trials-title").focus();
  };
  view.addEventListener("click", (_, item) => item?.datum?.contender && list(item.datum.contender, item.datum));
  for (const name of asked) $(name).addEventListener("input", () => later(0).then(update));
  $("reset").addEventListener("click", () => {
    for (const name of asked) view.signal(name, ($(name).value = initial[name]));
    update();
  });
  await (shown.trial ? open(shown.trial, shown.beside) : update());
}

// Open a trial: its commands, and where its run is carried the replay, beside another one's.
let replays, stop = () => {}, openings = 0;
async function opened(trial, beside, choose) {
  const opening = ++openings;
  stop();
  replays ??= await inflated(page.replays);
  const run = replays.runs[trial], nameOf = (id) => page.trial.get(id).contender, row = page.trial.get(trial);
  $("run").hidden = false;
  $("run-title").textContent = `${row.contender} on ${row.scenario}, seed ${row.seed}`;
  $("run-commands").textContent = `dikbench replay ${trial}\ndikbench run --formulation '${row.formulation}'${
    row.solver === "none" ? "" : ` --solver '${row.solver}'`} --scenario '${row.scenario}' --seed ${row.seed} --plant '${
    row.plant}' --reference ${row.reference === "rest" ? "time" : row.reference}`;
  $("run-missing").hidden = Boolean(run);
  $("run-shown").hidden = !run;
  $("run-title").focus();
  if (!run) return;
  const same = (id) => ["scenario", "seed", "plant", "reference"].every((key) => page.trial.get(id)[key] === row[key]);
  const others = Object.keys(replays.runs).filter((id) => id !== trial && same(id));
  $("beside").replaceChildren(new Option("nothing", ""), ...others.map((id) => new Option(nameOf(id), id)));
  $("beside").value = beside;
  $("beside").onchange = () => choose($("beside").value);
  const both = [trial, beside].filter((id) => replays.runs[id]), made = replays.cases[run.case];
  $("run-certificate").textContent = made.certificate.join("\n");
  const scenes = await Promise.all(both.map((id, k) => staged($("replays").children[k], replays, id, nameOf(id))));
  if (opening !== openings) return; // another trial has been opened meanwhile
  $("replays").children[1].hidden = both.length < 2;
  const runs = both.map((id) => replays.runs[id]);
  const end = Math.max(...runs.map((each) => each.dt * each.step.at(-1)));
  const traces = structuredClone(page.traces);
  traces.data.find((each) => each.name === "series").values = runs.flatMap((each, k) => each.step.map((step, at) => ({
    who: nameOf(both[k]), t: step * each.dt, error: each.error[at], speed: each.speed[at], margin: each.margin[at] })));
  const { view } = await vegaEmbed("#traces", traces, { mode: "vega", renderer: "svg", actions: false });
  const show = (t) => {
    $("clock").textContent = `${t.toFixed(2)} s`;
    $("instant").value = end ? t / end : 0;
    scenes.forEach((scene) => scene(t));
    view.signal("cursor", t).runAsync();
  };
  $("instant").oninput = ({ target }) => show(target.value * end);
  let playing = 0;
  stop = () => { cancelAnimationFrame(playing); playing = 0; $("go").textContent = "Play"; };
  $("go").onclick = () => {
    if (playing) return stop();
    let last = performance.now(), t = $("instant").value < 1 ? $("instant").value * end : 0;
    const go = (now) => {
      t += (now - last) / 1000 * $("pace").value;
      last = now;
      show(Math.min(t, end));
      if (t < end) playing = requestAnimationFrame(go); else stop();
    };
    $("go").textContent = "Pause";
    playing = requestAnimationFrame(go);
  };
  show(run.dt * run.step[Math.max(0, run.error.indexOf(Math.max(...run.error)))]);
}

// Put a run on a stage: returns what moves it to a time.
async function staged(figure, { runs, cases, robots, client }, id, name) {
  const run = runs[id], made = cases[run.case], robot = robots[made.robot];
  figure.firstElementChild.textContent = name;
  if (!robot) return () => {};
  const frame = openScene(figure.lastElementChild, client, robot.data, matchMedia("(prefers-color-scheme: dark)").matches);
  for (let k = 0; !isSceneReady(frame); k++) if (k < 200) await later(50); else return () => {};
  send(frame, made.messages);
  drawLine(frame, "/path", made.path, page.path_colour);
  const whole = (columns) => columns.map((column) => { let sum = 0; return column.map((each) => (sum += each) / 1e4); });
  const joints = whole(run.joints), target = whole(run.target);
  return (t) => {
    const k = Math.max(0, run.step.findLastIndex((step) => step * run.dt <= t + 1e-9)), next = Math.min(k + 1, run.step.length - 1);
    const share = next > k ? Math.min(1, Math.max(0, t / run.dt - run.step[k]) / (run.step[next] - run.step[k])) : 0;
    const at = (columns) => columns.map((column) => column[k] + share * (column[next] - column[k]));
    moveRobot(frame, robot.joints, at(joints), [...run.near[k]].map((digit) => page.colours[digit]));
    moveNode(frame, "/target", at(target));
  };
}

if (page) play().catch((error) => { $("play").hidden = false; $("leading").textContent = `The charts cannot be shown: ${error}`; });
