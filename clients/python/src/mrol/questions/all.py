"""All questions that a map is asked, whatever answers them."""

from .checks import CheckQuestions
from .classification import ClassificationQuestions
from .frontiers import FrontierQuestions
from .grid import GridQuestions
from .motions import MotionQuestions
from .nearest import NearestQuestions
from .occupancy import OccupancyQuestions
from .rays import RayQuestions


class Questions(
    OccupancyQuestions,
    ClassificationQuestions,
    CheckQuestions,
    MotionQuestions,
    RayQuestions,
    NearestQuestions,
    FrontierQuestions,
    GridQuestions,
):
    """What a map is asked: by `mrol.Map` a server, by `mrol.replica.Replica` and `mrol.replica.LocalMap` this process.

    A program that only asks takes any of them as `mrol.Questions`. All questions raise `ArgumentError` for arguments that make no
    question, `ServerError` for what is refused, whichever answers, and `BadAnswer`. Lengths are meters.

    More elements than are answered at once, 2,000,000 of them, are asked about in parts, between which the map may change:
    `first_version` and `version` of the answer tell.
    """
