"""Questions about more elements than are taken at once, and about none, as `mrol.Map` takes them."""

from collections.abc import Callable

from mrol import FailedPrecondition
from mrol._arrays import F32
from mrol._transport.deadline import TIMEOUT_MAX_S, Deadline
from mrol.operations import parts
from mrol.operations.parts import Answer, Part, ask_in_parts, shaped

from ._failures import exception


def answered(count: int, rows: F32, shape: tuple[int, ...], ask: Callable[[slice], Answer]) -> Answer:
    """The answer about so many elements, whose numbers are in rows, in the shape in which they were given.

    `ask` answers about a slice of the elements, in arrays with one axis for them. Of no elements the first of what it asks about
    stands in. Where one replaced map would be joined with another the answer is `FailedPrecondition` (`map_replaced`).
    """
    if count > 0 and (count == 1 or max(count, len(rows)) <= parts.ELEMENTS_MAX):
        answer = ask(slice(0, count))
        return answer if shape == (count,) else shaped(answer, shape)

    def of_part(part: Part) -> Answer:
        answer = ask(part.of)
        if part.map_uuid not in (None, answer.map_uuid):
            message = f"the map was replaced between two parts of a question: it was {part.map_uuid}, and is {answer.map_uuid}"
            replaced = exception("refused", "failed_precondition", "map_replaced", message)
            assert isinstance(replaced, FailedPrecondition)
            raise replaced
        return answer

    return ask_in_parts(Deadline(TIMEOUT_MAX_S), count, rows.nbytes, shape, of_part)
