// A table that is wider than its box can be scrolled by the keyboard. Material wraps tables when it starts.
const reach = () => {
  for (const box of document.querySelectorAll(".md-typeset__scrollwrap")) {
    const scrolls = box.scrollWidth > box.clientWidth;
    Object.assign(box, { tabIndex: scrolls ? 0 : -1, role: scrolls ? "group" : null, ariaLabel: scrolls ? "Table" : null });
  }
};
addEventListener("load", () => setTimeout(reach));
addEventListener("resize", reach);
