// The controls of one view set those of all others that have the same choice.
(() => {
  const others = (control) => [...document.querySelectorAll(".viewer")]
    .filter((view) => !view.contains(control))
    .map((view) => view.querySelector(`[name=${control.name}]`))
    .filter(Boolean);
  document.addEventListener("input", (e) => {
    for (const each of others(e.target)) {
      if (each.options && ![...each.options].some((option) => option.value === e.target.value)) continue;
      each.value = e.target.value;
      each.checked = e.target.checked;
      each.dispatchEvent(new Event("input")); // which does not bubble
    }
  });
  document.addEventListener("click", (e) => {
    if (e.isTrusted && e.target.name === "home") others(e.target).forEach((each) => each.click());
  });
})();
