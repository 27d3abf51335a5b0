"""`kept`: keeps results that were computed from an object, exactly as long as that object lives.

A cache in the module would keep the last reduced fingers alive and, with them, their models and factors: hundreds of MB
each.
"""

from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from papilla.errors import ContactRangeError

Function = TypeVar("Function", bound=Callable[..., Any])


def kept(most: int) -> Callable[[Function], Function]:
    """Decorator: keep the last `most` results of a function with the object that is its first argument, by its other
    arguments.

    The other arguments must be hashable. A `ContactRangeError` is kept, too, and raised again.
    """

    def decorate(function: Function) -> Function:
        """The function with kept results."""
        name = f"_kept_{function.__module__}.{function.__name__}"

        @wraps(function)
        def found(owner: Any, *others: Any) -> Any:
            """The kept result, or a new one, which is then kept with `owner`."""
            known = vars(owner).setdefault(name, OrderedDict())
            if others not in known:
                try:
                    known[others] = function(owner, *others)
                except ContactRangeError as error:
                    known[others] = error.with_traceback(None)
                if len(known) > most:
                    known.popitem(last=False)
            known.move_to_end(others)
            if isinstance(known[others], ContactRangeError):
                raise known[others]
            return known[others]

        return found  # type: ignore[return-value]

    return decorate
