"""People who share a console: accounts, roles, sessions, invitations, and what their roles allow.

    people.py       a person and the four roles
    rights.py       who may do what: one table
    passwords.py    hashes by Argon2
    tables.py       the tables
    store.py        accounts and the log of what organisers did
    invitations.py  links by which an account gets a password
    invitation_csv.py  many invitations from a file
    sessions.py     who is signed in
    attempts.py     how often somebody may try to sign in

Begin with `rights.py`, then `store.py`. This package knows no page and no race.
"""
