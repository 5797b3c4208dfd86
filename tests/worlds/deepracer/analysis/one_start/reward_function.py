def reward_function(params):
    """More for the middle of the road."""
    if not params["all_wheels_on_track"]:
        return 1e-3
    return float(max(1e-3, 1 - (params["distance_from_center"] / (params["track_width"] / 2)) ** 2) * params["speed"])
