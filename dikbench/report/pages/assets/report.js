// Headings become buttons that sort (sortable.js listens to their clicks), rows can be filtered.
"use strict";

for (const table of document.querySelectorAll("table.sortable")) {
  for (const heading of table.tHead.rows[0].cells) {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...heading.childNodes);
    heading.append(button);
  }
}

const filter = document.getElementById("filter");
const shown = document.getElementById("rows-shown");
const rows = () => document.querySelectorAll("table.sortable > tbody > tr");

// A row stays where every word of the filter occurs in its law or its solver.
function apply() {
  const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
  let left = 0;
  let all = 0;
  for (const row of rows()) {
    const names = Array.from(row.querySelectorAll(".name"), (cell) => cell.textContent).join(" ");
    row.hidden = !words.every((word) => names.toLowerCase().includes(word));
    left += !row.hidden;
    all += 1;
  }
  shown.textContent = words.length ? `${left} of ${all} rows` : "";
}

filter.addEventListener("input", apply);
document.getElementById("filtering").addEventListener("submit", (event) => event.preventDefault());
document.getElementById("filtering").hidden = false;
