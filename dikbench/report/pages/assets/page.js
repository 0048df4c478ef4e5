// Glue between the controls, Vega's charts and viser's replays: what is computed is declared in Python.
const $ = (id) => document.getElementById(id);
const element = (tag, text = "", attributes = {}) =>
  Object.assign(document.createElement(tag), { textContent: text }, attributes);
const number = (value, digits = 3) => (value == null ? "" : String(Number(value.toPrecision(digits))));
const percent = (value) => (100 * value).toFixed(1);

// Every heading of a sortable table is a button that sorts its rows; numbers before texts.
function sortable(table) {
  for (const heading of table.tHead.rows[0].cells) {
    const button = element("button", "", { type: "button" });
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => {
      const falls = heading.getAttribute("aria-sort") === "descending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", falls ? "ascending" : "descending");
      const key = (row) => {
        const cell = row.cells[heading.cellIndex];
        const text = cell.dataset.sort ?? cell.textContent;
        return text.trim() === "" || Number.isNaN(Number(text)) ? text : Number(text);
      };
      const compare = (a, b) =>
        typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === "number" ? -1 : 1;
      const last = (a) => (a === "" ? 1 : 0);
      const rows = Array.from(table.tBodies[0].rows, (row) => [key(row), row]);
      rows.sort(([a], [b]) => last(a) - last(b) || (falls ? compare(a, b) : compare(b, a)));
      table.tBodies[0].append(...rows.map(([, row]) => row));
    });
  }
}
document.querySelectorAll("table.sortable").forEach(sortable);

// A row of the tables below stays where every word of the filter occurs in its names.
function filterRows() {
  const words = $("filter").value.toLowerCase().split(/\s+/).filter(Boolean);
  const rows = Array.from(document.querySelectorAll("#tables table > tbody > tr, .entry table > tbody > tr"));
  for (const row of rows) {
    const names = Array.from(row.querySelectorAll(".name"), (cell) => cell.textContent).join(" ");
    row.hidden = !words.every((word) => names.toLowerCase().includes(word));
  }
  const left = rows.filter((row) => !row.hidden).length;
  $("rows-shown").textContent = words.length ? `${left} of ${rows.length} rows` : "";
}
$("filter").addEventListener("input", filterRows);
$("filtering").addEventListener("submit", (event) => event.preventDefault());
$("filtering").hidden = false;

const page = $("page-data") && JSON.parse($("page-data").textContent);
if (page) play(page).catch((error) => ($("leading").textContent = `The charts cannot be shown: ${error}`));

async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return JSON.parse(await new Response(stream).text());
}

function rowsOf(columns) {
  const names = Object.keys(columns);
  const value = ({ words, values }, place) => (words ? words[values[place]] : values[place]);
  return columns[names[0]].values.map((_, place) =>
    Object.fromEntries(names.map((name) => [name, value(columns[name], place)])),
  );
}

async function play(page) {
  const asked = [...page.controls, ...page.phase].filter((name) => $(name));
  const initial = Object.fromEntries(asked.map((name) => [name, $(name).value]));
  const linked = new URLSearchParams(location.hash.includes("=") ? location.hash.slice(1) : "");
  for (const name of asked) {
    if (!linked.has(name)) continue;
    $(name).value = linked.get(name);
    if ($(name).value !== linked.get(name)) $(name).value = initial[name];
  }
  page.specification.datasets = {};
  const data = page.specification.data.find((each) => each.name === page.rows);
  data.values = rowsOf(await inflated(page.columns));
  $("play").hidden = false;
  const options = { mode: "vega", renderer: "svg", actions: false };
  const { view } = await vegaEmbed("#charts", page.specification, options);
  const shown = { trial: linked.get("trial") ?? "", beside: linked.get("beside") ?? "" };
  const update = () => told(page, view, asked, initial, shown);
  for (const name of asked) $(name).addEventListener("input", () => setTimeout(() => view.runAsync().then(update)));
  $("reset").addEventListener("click", () => {
    for (const name of asked) {
      $(name).value = initial[name];
      view.signal(name, initial[name]);
    }
    view.runAsync().then(update);
  });
  const list = async (law, chosen = {}) => listed(page, await trialsOf(page, view, law), law, chosen, open);
  const open = (trial) => {
    shown.trial = trial;
    update();
    opened(page, shown, update);
  };
  view.addEventListener("click", (_, item) => item?.datum?.law && list(item.datum.law, item.datum));
  $("ranking").tBodies[0].addEventListener("click", ({ target }) => target.dataset.law && list(target.dataset.law));
  update();
  if (shown.trial) opened(page, shown, update);
}

// The sample, the leading laws and the ranking of the view; its state in the address.
function told(page, view, asked, initial, shown) {
  for (const output of document.querySelectorAll("#controls label output")) {
    const slider = $(output.htmlFor.value);
    output.textContent = slider.dataset.texts.split("|")[slider.value];
  }
  const rows = view.data(page.ranking).toSorted((a, b) => a.place - b.place || a.law.localeCompare(b.law));
  const first = rows.filter((row) => row.tied);
  const [trials, scenarios] = rows.length ? [rows.map((row) => row.trials), rows[0].count] : [[0], 0];
  const most = Math.max(...trials);
  $("sample").textContent = `${rows.length} formulations, ${most} trials each, ${scenarios} scenarios`;
  const named = first.slice(0, 6).map((row) => `${row.law} (${percent(row.rate)} %)`).join(", ");
  const more = first.length > 6 ? ` and ${first.length - 6} more` : "";
  $("leading").textContent = !rows.length
    ? "No trial is left: choose less."
    : scenarios < page.fewest
      ? `Nobody is ranked: fewer than ${page.fewest} scenarios.`
      : !first.length
        ? "Nobody succeeds in this view."
        : first.length === 1
          ? `In this view ${named} succeeds most often; the others can be told apart from it.`
          : `In this view ${named}${more} succeed most often and cannot be told apart.`;
  const body = $("ranking").tBodies[0];
  body.replaceChildren(...rows.map((row) => {
    const place = !row.whole || scenarios < page.fewest ? "" : row.tied ? `1 to ${first.length}` : row.place;
    const line = element("tr");
    const button = element("button", "show", { type: "button" });
    button.dataset.law = row.law;
    const sorted = element("td", place === "" ? "not ranked" : first.length === 1 && row.tied ? "1" : place);
    sorted.dataset.sort = place === "" ? "" : row.tied ? 1 : row.place;
    const last = element("td", "", { className: "name" });
    last.append(button);
    line.append(
      sorted, element("th", row.law, { className: "name", scope: "row" }), element("td", percent(row.rate)),
      element("td", percent(row.difference)), element("td", `${percent(row.lower)} to ${percent(row.upper)}`),
      element("td", row.trials), last,
    );
    return line;
  }));
  const state = asked.filter((name) => $(name).value !== initial[name]).map((name) => [name, $(name).value]);
  for (const name of ["trial", "beside"]) if (shown[name]) state.push([name, shown[name]]);
  const text = new URLSearchParams(state).toString();
  if (text || location.hash.includes("=")) history.replaceState(null, "", text ? `#${text}` : location.pathname);
}

async function trialsOf(page, view, law) {
  await view.signal("picked", law).runAsync();
  return view.data(page.trials);
}

// The trials of a law in this view, the worst first, those of one situation where it was chosen.
function listed(page, rows, law, { situation = "", category = null }, open) {
  const chosen = rows
    .filter((row) => (!situation || row.situation === situation) && (category === null || row.category === category))
    .toSorted((a, b) => b.category - a.category || (b.farthest ?? 1e9) - (a.farthest ?? 1e9));
  const body = $("trials").querySelector("tbody");
  const fill = (most) => {
    body.replaceChildren(...chosen.slice(0, most).map((row) => {
      const button = element("button", `${row.id}${page.runs[row.id] === undefined ? "" : " \u25B6"}`, { type: "button" });
      button.addEventListener("click", () => open(row.id));
      const line = element("tr");
      const last = element("td", "", { className: "name" });
      last.append(button);
      line.append(
        element("th", row.scenario, { className: "name", scope: "row" }),
        element("td", page.categories[row.category], { className: "name" }), element("td", row.seed),
        element("td", row.reference, { className: "name" }), element("td", number(row.farthest)),
        element("td", number(row.error)), element("td", number(row.peak)), last,
      );
      return line;
    }));
    $("more-trials").hidden = chosen.length <= most;
  };
  fill(12);
  $("more-trials").onclick = () => fill(Infinity);
  $("trials-title").textContent =
    `${law}${situation ? `, ${situation}` : ""}: ${chosen.length} trials, the worst first (\u25B6 plays here)`;
  $("trials").hidden = false;
  $("trials-title").focus();
}
