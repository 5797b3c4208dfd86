"""Where snakes meet and are judged. Begin in `match.py`: one game, from set-up to its winner.

match.py        one game between seats, every missing move made good by the official rule
live.py         a game before an audience, at a pace
seats.py        who sits at the board, how long it took, how often it failed
remote.py       a snake server somewhere, asked over HTTP
record.py       the output file of the official `battlesnake play`, both ways
game_files.py   games to verify, from every file they are kept in; transcript.py reads moves off their positions
tournament.py   everyone against everyone, seats swapped; standings.py its table, tournament_file.py its games kept
batch.py        many games at once between a policy and anchors
"""
