"""A pupil who has a keyboard and nothing else: goes to a field by Tab, answers, and reads what is said."""

from tests.lessons.answers import RIGHT

MAX_TABS = 600
BESIDE = """which => {
  const wanted = document.querySelector(which), now = document.activeElement;
  if (wanted === now || wanted.contains(now)) return "there";
  return now.compareDocumentPosition(wanted) & Node.DOCUMENT_POSITION_PRECEDING ? "Shift+Tab" : "Tab";
}"""


class Pupil:
    """Walks through lessons.

    Args:
        browser: Whose page is used.
        address: Of the course, up to the path.
        answers: In place of the right ones, by "lesson/exercise".
    """

    def __init__(self, browser, address, answers):
        self.browser, self.page, self.address, self.answers = browser, browser.page, address, answers

    def walk(self, lesson):
        """Open a lesson and do every exercise of it; return what the page says was not done."""
        self.browser.open(f"{self.address}/lessons/{lesson.id}")
        self.browser.until("document.readyState === 'complete'")
        for exercise in lesson.exercises:
            where = f"{lesson.id}/{exercise.id}"
            self.do(exercise, self.answers.get(where, RIGHT[where]))
        return self.browser.value(
            "[...document.querySelectorAll('.exercise')].filter(one => !one.querySelector('[data-state].good'))"
            ".map(one => one.dataset.exercise + ': ' + one.querySelector('.said').textContent)"
        )

    def do(self, exercise, given):
        """Answer an exercise; of a prediction the reason as well, once the run was seen."""
        part = f"[data-exercise={exercise.id}]"
        for later in (False, True) if exercise.kind == "prediction" else (False,):
            for field in exercise.fields:
                if field.later == later:
                    getattr(self, field.kind)(part, field, given[field.name])
            self.go(f"{part} [type=submit]")
            self.browser.press("Enter")
            self.page.wait_for_timeout(30)
            self.browser.until(f"!document.querySelector('{part}').hasAttribute('aria-busy')", 240)

    def go(self, which):
        """Press Tab, or Shift and Tab, until an element has the focus."""
        for _ in range(MAX_TABS):
            key = self.page.evaluate(BESIDE, which)
            if key == "there":
                return
            self.browser.press(key)
        raise AssertionError(f"{which}: no Tab leads there")

    def number(self, part, field, value):
        """Write a number."""
        self.go(f"{part} [data-name={field.name}] input")
        self.browser.press("Control+A")
        self.page.keyboard.type(value)

    def code(self, part, field, value):
        """Put code in place of what stands there."""
        self.go(f"{part} [data-name={field.name}] textarea")
        self.browser.press("Control+A")
        self.page.keyboard.insert_text(value)

    def choice(self, part, field, value):
        """Choose by the arrow keys."""
        self.go(f"{part} [data-name={field.name}]")
        self.browser.press(" ")
        self._down_to(value)

    def model(self, part, field, value):
        """Choose a trained car by the arrow keys."""
        self.go(f"{part} [data-name={field.name}] select")
        self._down_to(value)

    def _down_to(self, value):
        for _ in range(20):
            if self.browser.value("document.activeElement.value") == value:
                return
            self.browser.press("ArrowDown")
        raise AssertionError(f"{value}: no such choice")

    def take(self, part, field, value):
        """Do something in a figure."""
        getattr(self, f"take_{field.name}")(f"[data-figure={field.figure}]:not(.field)", value)

    def take_drive(self, figure, value):
        """Drive with the letters."""
        self.go(f"{figure} td[tabindex='0']")
        for move in value["moves"]:
            self.browser.press("lsr"[move])

    def take_moves(self, figure, value):
        """Begin a new game and move the snake by the arrow keys."""
        self.go(f"{figure} .keys button:last-child")
        self.browser.press("Enter")
        self.go(f"{figure} table")
        for move in value:
            self.browser.press(f"Arrow{move.capitalize()}")

    def take_actions(self, figure, value):
        """Begin a new episode and move the agent of Basic by the arrow keys."""
        self.go(f"{figure} .keys button:last-child")
        self.browser.press("Enter")
        self.go(f"{figure} table")
        for action in value:
            self.browser.press(("ArrowDown", "ArrowLeft", "ArrowRight")[action])

    def take_grid(self, figure, value):
        """Change squares, tenth by tenth."""
        self.go(f"{figure} td[tabindex='0']")
        at = [2, 0]
        for row, column, pay in value["changed"]:
            for key, times in (("ArrowUp", at[0] - row), ("ArrowDown", row - at[0]), ("ArrowRight", column - at[1])):
                for _ in range(max(0, times)):
                    self.browser.press(key)
            at = [row, column]
            for _ in range(round(10 * (pay - (0.1 if row in (1, 3) else 2.0)))):
                self.browser.press("+")

    def take_batch(self, figure, value):
        """Write four drives."""
        for number, moves in enumerate(value, 1):
            self.go(f"{figure} tbody tr:nth-child({number}) input")
            self.browser.press("Control+A")
            self.page.keyboard.type("".join("lsr"[move] for move in moves))
            self.browser.press("Tab")

    def take_patch(self, figure, value):
        """Move the sliders: picture, row, column, height, width."""
        (top, left, height, width), number = value["patch"], value["picture"]
        for at, wanted in enumerate((number - 1, top, left, height, width - 1), 1):
            self.go(f"{figure} .tools label:nth-child({at}) input")
            self.browser.press("Home")
            for _ in range(wanted):
                self.browser.press("ArrowRight")
