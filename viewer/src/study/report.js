// Sorts a table by the column whose head is clicked; a second click turns the order round.
document.querySelectorAll("th").forEach((head) => {
  head.addEventListener("click", () => {
    const row = head.parentNode, column = [...row.children].indexOf(head);
    const down = head.getAttribute("aria-sort") === "ascending";
    [...row.children].forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const body = head.closest("table").tBodies[0];
    const key = (line) => {
      const cell = line.children[column];
      return cell.dataset.value === undefined ? cell.textContent : Number(cell.dataset.value);
    };
    const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b)));
    [...body.rows].sort((a, b) => (down ? -1 : 1) * compare(key(a), key(b))).forEach((line) => body.append(line));
  });
});
