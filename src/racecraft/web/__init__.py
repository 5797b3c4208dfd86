"""Pages, JSON and push over HTTP, for every server of ours: Starlette on uvicorn. Begin with `application.py`.

    make_application(routes, access)     who may ask, limits, headers, errors: once for all servers
    serve(application, host, port, …)    until Ctrl-C or SIGTERM; `ServerThread` beside other work
    page_answer, json_answer, …          what a route returns
    Topic, events_answer                 push (Server-Sent Events)

A route that is a plain `def` runs in a thread, so slow work belongs there; an `async def` must not wait for anything.
This package knows no world and no page of its own but `error.html`.
"""
