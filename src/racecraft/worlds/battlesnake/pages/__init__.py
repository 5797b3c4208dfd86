"""Templates, styles and modules of pages about games; `racecraft.pages` finds them by this package's name.

board.html   a game: step, play, scrub      arena.html   ratings, who met whom, the latest games
"""
