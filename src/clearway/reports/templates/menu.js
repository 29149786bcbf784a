// The menu of sections, where there is no room for a bar.
(() => {
  const button = document.getElementById("menu"), list = document.getElementById("sections");
  const open = (wanted) => { button.setAttribute("aria-expanded", String(wanted)); list.classList.toggle("open", wanted); };
  button.addEventListener("click", () => open(button.getAttribute("aria-expanded") !== "true"));
  list.addEventListener("click", (event) => { if (event.target.closest("a")) open(false); });
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") open(false); });
})();
