// Finding a class: the tree shows those whose full name or description holds what was typed.
(function () {
  const field = document.getElementById("find");
  const tree = document.getElementById("tree");
  function show(item, wanted) {
    const link = item.querySelector("a");
    let found = link.dataset.name.includes(wanted);
    const details = item.querySelector(":scope > details");
    if (details) {
      let inner = false;
      for (const child of details.querySelectorAll(":scope > ul > li")) inner = show(child, wanted) || inner;
      if (wanted) details.open = inner;
      found = found || inner;
    }
    item.classList.toggle("hidden", !found);
    return found;
  }
  field.addEventListener("input", function () {
    const wanted = field.value.trim().toLowerCase();
    for (const item of tree.children) show(item, wanted);
  });
})();

// What is wider than its place is scrolled by keys, too.
for (const wide of document.querySelectorAll(".equation, .when")) if (wide.scrollWidth > wide.clientWidth) wide.tabIndex = 0;
