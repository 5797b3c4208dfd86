"""The course: lessons, exercises and the teacher's sheet. Begin with `lesson.py`, then `course.py`.

    texts/         one CommonMark file a lesson, in English; page, exercises and sheet are made from it
    lesson.py      what a lesson is made of
    reading.py     a text becomes a lesson
    course.py      every lesson that is installed, in order: ours and those of worlds
    checking.py    what a pupil answered, and what a check says of it
    exercises/     checks by lesson: each runs something and reads its result
    models/        what the figures compute, in Python; modules/ has the same as ES modules
    progress.py    what a pupil did, kept in the account's data folder
    service.py     pages and answers; the console and `racecraft lessons` share them

A world adds lessons by `WorldKind.lessons`; `course.py` says what its package holds.
"""
