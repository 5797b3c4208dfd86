"""How pages and figures look, for files and servers alike. Begin with `render.py`.

    templates/   Jinja2: `document.html` (head, styles, modules), `page.html` (one column, for files),
                 `shell.html` (side bar, for servers), `parts.html` (macros of all parts)
    styles/      `tokens.css` holds every colour, size and time; no other file has a colour
    modules/     ES modules: `chart.js` is `<rc-chart>`
    vendor/      uPlot and Inter with their licences, put here by scripts/vendor_javascript.py

A world keeps its own templates, styles and modules in its package `pages` and names them with that package:
`render("racecraft.worlds.deepracer.pages/why.html", …)`. Nothing has to be registered.
"""
