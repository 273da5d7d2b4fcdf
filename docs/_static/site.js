// Tables of the class sortable are sorted by the column whose heading is clicked; numbers in them by what they are with their prefix.
const PREFIX = { n: 1e-9, "µ": 1e-6, m: 1e-3, k: 1e3, M: 1e6, G: 1e9 };
function size(text) {
  const found = /(-?[\d.]+(?:e[-+]?\d+)?)\s*(?:([nµmkMG])(?=[A-Za-z]))?/.exec(text.replace(/^[^ ]*\.\w+ /, ""));
  return found && /\d/.test(text) ? Number(found[1]) * (PREFIX[found[2]] ?? 1) : Infinity;
}
document.querySelectorAll("table.sortable").forEach((table) => {
  const body = table.tBodies[0];
  table.querySelectorAll("thead th").forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const cell = (row) => row.cells[column].textContent.trim();
      const isName = column < 2;
      const rows = [...body.rows].sort((a, b) => (isName ? cell(a).localeCompare(cell(b)) : size(cell(a)) - size(cell(b))));
      table.querySelectorAll("thead th").forEach((own) => own.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", "ascending");
      body.append(...rows);
    });
  });
});

// What scrolls can be reached by keys, and a picture that is a link says where it leads.
document.querySelectorAll(".highlight pre, .table-wrapper, div.math").forEach((own) => { own.tabIndex = 0; });
document.querySelectorAll(".sphx-glr-thumbcontainer").forEach((own) => {
  const title = own.querySelector(".sphx-glr-thumbnail-title")?.textContent.trim() ?? "";
  own.querySelectorAll("a").forEach((link) => link.setAttribute("aria-label", title));
});
