// Glue between the controls, Vega's charts and viser's replays: what is computed is declared in Python.
const $ = (id) => document.getElementById(id);
const page = JSON.parse($("page-data")?.textContent ?? "null");

function button(content, onclick) {
  const made = Object.assign(document.createElement("button"), { type: "button", onclick });
  made.append(...content);
  return made;
}

// Fill a table with rows, by the fields that its headings name; one is a button that opens the row.
function fill(table, rows, open) {
  table.tBodies[0].replaceChildren();
  for (const row of rows) {
    const line = table.tBodies[0].insertRow();
    for (const { dataset, className } of table.tHead.rows[0].cells) {
      const cell = document.createElement(dataset.opens ? "th" : "td"), text = row[dataset.field] ?? "";
      cell.className = className;
      cell.append(dataset.opens ? button([text], () => open(row)) : text);
      line.append(cell);
    }
  }
}

// A heading of a sortable table is a button that sorts its rows: numbers first, what is empty last.
const told = (cell) => cell.dataset.sort ?? cell.textContent.trim();
const kind = (text) => (text === "" ? 2 : Number(isNaN(parseFloat(text))));
for (const heading of document.querySelectorAll("table.sortable > thead th")) {
  heading.append(button(heading.childNodes, () => {
    const [body] = heading.closest("table").tBodies, rises = heading.ariaSort !== "ascending";
    for (const cell of heading.parentNode.cells) cell.ariaSort = null;
    heading.ariaSort = rises ? "ascending" : "descending";
    body.append(...[...body.rows].sort((row, other) => {
      const [a, b] = [row, other].map(({ cells }) => told(cells[heading.cellIndex]));
      const order = kind(a) ? a.localeCompare(b) : parseFloat(a) - parseFloat(b);
      return kind(a) - kind(b) || (rises ? order : -order);
    }));
  }));
}

// A row of the tables below stays where every word of the filter occurs in its names.
$("filter").addEventListener("input", ({ target }) => {
  const words = target.value.split(/\s+/).filter(Boolean), rows = [...document.querySelectorAll("tr[data-names]")];
  const asked = words.map((word) => `[data-names*="${CSS.escape(word)}" i]`).join("");
  for (const row of rows) row.hidden = !row.matches(`tr${asked}`);
  const left = rows.filter((row) => !row.hidden).length;
  $("rows-shown").value = asked && `${left} of ${rows.length} rows`;
});

async function inflated(text) {
  const { body } = await fetch(`data:application/gzip;base64,${text}`);
  return new Response(body.pipeThrough(new DecompressionStream("gzip"))).json();
}

// Say who leads in a view: of what its controls ask for.
function leading(rows) {
  if (rows[0]?.nobody !== "") return rows[0]?.nobody ?? "No trial is left: choose less.";
  const best = rows.filter(({ place }) => place === 1), near = rows.filter(({ place, tied }) => place > 1 && tied);
  const named = (some) => some.slice(0, 5).map(({ said }) => said).join(", ")
    + (some.length > 5 ? ` and ${some.length - 5} more` : "");
  const others = rows[0].relative || (near.length ? `not told apart: ${named(near)}` : "all others are told apart");
  return `${rows[0].view}: ${named(best)}; ${others}. ${rows[0].intervals}`;
}

async function play() {
  const form = $("controls"), state = () => Object.fromEntries(new FormData(form)), initial = state();
  const columns = Object.entries(await inflated(page.columns));
  const rows = columns[0][1].values.map((_, k) => Object.fromEntries(
    columns.map(([name, { words, values }]) => [name, words ? words[values[k]] : values[k]])));
  const trials = new Map(rows.map((row) => [row.id, row]));
  page.specification.data.find(({ name }) => name === page.rows).values = rows;
  const { view } = await vegaEmbed("#charts", page.specification);
  let shown = "";
  const update = async () => {
    const asked = state(), moved = Object.entries(asked).filter(([name, value]) => value !== initial[name]);
    for (const name in asked) view.signal(name, asked[name]);
    await view.runAsync();
    const [ranking, listed] = page.tables.map((name) => view.data(name).toSorted((a, b) => a.order - b.order));
    fill($("ranking"), ranking, list);
    fill($("trials-table"), listed, ({ id }) => set({ trial: id, beside: "" }, "run-title"));
    $("tolerance-shown").value = $("tolerance").ariaValueText = page.tolerances[asked.tolerance];
    $("leading").textContent = leading(ranking);
    $("sample").value = ranking[0]?.sample ?? "";
    $("trials").hidden = !asked.picked;
    $("trials-title").textContent = `The worst first: ${listed.length} trials of ${asked.picked} ${asked.where}`;
    if (moved.length || location.hash.includes("=")) history.replaceState(null, "", `#${new URLSearchParams(moved)}`);
    if (shown === asked.trial + asked.beside || !trials.has(asked.trial)) return;
    shown = asked.trial + asked.beside;
    await opened(asked, trials, (beside) => set({ beside }));
  };
  const set = async (changes, heading) => {
    for (const name in changes) form.elements[name].value = changes[name];
    await update();
    if (heading) $(heading).focus();
  };
  const list = ({ contender: picked, situation: where = "", category: ended = "" }) =>
    set({ picked, where, ended }, "trials-title");
  view.addEventListener("click", (_, item) => item?.datum?.contender && list(item.datum));
  for (const on of ["oninput", "onchange"]) $("play")[on] = ({ target }) => target.form === form && update();
  form.addEventListener("reset", () => setTimeout(update)); // once it is done
  for (const name in initial) {
    form.elements[name].value = new URLSearchParams(location.hash.slice(1)).get(name) ?? initial[name];
    form.elements[name].value ||= initial[name]; // what a list does not have
  }
  await update();
}

// Open a trial: its commands, and where its run is carried the replay, beside another one's.
let replays, openings = 0;
async function opened({ trial, beside }, trials, choose) {
  const opening = ++openings, row = trials.get(trial);
  replays ??= await inflated(page.replays);
  const { runs, cases } = replays, run = runs[trial];
  $("run").className = run ? "carried" : "missing";
  $("run-title").textContent = `${row.contender} on ${row.scenario}, seed ${row.seed}`;
  $("run-commands").textContent = `dikbench replay ${trial}\ndikbench run ${row.asked_law} ${row.asked_case}`;
  $("go").checked = false;
  if (!run) return;
  const others = Object.keys(runs).filter((id) => id !== trial && runs[id].group === run.group);
  const options = others.map((id) => new Option(trials.get(id).contender, id));
  $("beside").replaceChildren(new Option("nothing", ""), ...options);
  Object.assign($("beside"), { value: beside, onchange: ({ target }) => choose(target.value) });
  $("run-certificate").textContent = cases[run.case].certificate.join("\n");
  const both = [trial, beside].filter((id) => runs[id]).map((id) => ({ ...trials.get(id), ...runs[id] }));
  $("replays").children[1].hidden = both.length < 2;
  page.traces.data.find(({ name }) => name === "series").values = both;
  const { view } = await vegaEmbed("#traces", page.traces);
  if (opening !== openings) return; // another trial has been opened meanwhile
  const scenes = [], end = Math.max(...both.map(({ step, dt }) => step.at(-1) * dt));
  let at = run.worst, last = 0;
  const show = (t) => {
    at = t;
    $("clock").value = `${t.toFixed(2)} s`;
    $("instant").value = t;
    for (const move of scenes) move(t);
    view.signal("cursor", t).runAsync();
  };
  const advance = (now) => {
    if (opening !== openings || !$("go").checked) return;
    show(Math.min(end, at + (now - last) / 1000 * $("pace").value));
    last = now;
    $("go").checked = at < end;
    requestAnimationFrame(advance);
  };
  $("go").onchange = ({ timeStamp }) => {
    [at, last] = [at < end ? at : 0, timeStamp];
    requestAnimationFrame(advance);
  };
  Object.assign($("instant"), { max: end, step: end / 1000, oninput: ({ target }) => show(target.valueAsNumber) });
  show(at);
  both.forEach((each, k) => staged($("replays").children[k], each).then((move) => scenes.push(move) && move(at)));
}

// Put a run on a stage: returns what moves it to a time.
async function staged({ firstElementChild: name, lastElementChild: host }, { contender, step, dt, near, ...run }) {
  const { messages, path, robot } = replays.cases[run.case], { data, joints } = replays.robots[robot] ?? {};
  name.textContent = contender;
  if (!data) return () => {};
  const frame = openScene(host, replays.client, data, matchMedia("(prefers-color-scheme: dark)").matches);
  while (frame.isConnected && !isSceneReady(frame)) await new Promise(requestAnimationFrame);
  if (!frame.isConnected) return () => {};
  send(frame, messages);
  drawLine(frame, "/path", path, page.path_colour);
  const columns = run.columns.map((column) => { let sum = 0; return column.map((each) => (sum += each) / 1e4); });
  return (t) => {
    const k = Math.max(0, step.findLastIndex((each) => each <= t / dt + 1e-6)), next = step[k + 1] ?? Infinity;
    const share = Math.max(0, t / dt - step[k]) / (next - step[k]);
    const c = columns.map((column) => column[k] + share * ((column[k + 1] ?? 0) - column[k]));
    moveRobot(frame, joints, c, Array.from(near[k], (digit) => page.colours[digit]));
    moveNode(frame, "/target", c.slice(-7));
  };
}

if (page) play().catch((error) => { $("leading").textContent = `The charts cannot be shown: ${error}`; });
