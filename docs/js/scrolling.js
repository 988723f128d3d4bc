// A table or formula that is wider than its box can be scrolled by the keyboard. Material wraps tables when it starts.
const reach = () => {
  for (const box of document.querySelectorAll(".md-typeset__scrollwrap, .formula")) {
    const scrolls = { tabindex: "0", role: "group", "aria-label": box.matches(".formula") ? "Formula" : "Table" };
    for (const [name, value] of Object.entries(scrolls)) {
      if (box.scrollWidth > box.clientWidth) box.setAttribute(name, value);
      else box.removeAttribute(name);
    }
  }
};
addEventListener("load", () => setTimeout(reach));
addEventListener("resize", reach);
