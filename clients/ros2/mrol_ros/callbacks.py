"""How callbacks of ROS are run: none holds up another, or ends it."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event, Thread
from typing import Any

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future

FAILED_PAUSE_S = 0.1
"""How long nothing is done after a callback has failed."""


def spin(executor: Executor, failed: Callable[[Exception], None], ended: Event) -> None:
    """Runs callbacks until the executor is shut down; `failed` is told of one that raises, and the others go on.

    A callback under which the executor is shut down may raise as well, which is no defect: `ended` is set before that.
    """
    while True:
        try:
            executor.spin()
        except Exception as error:
            if ended.is_set():
                return
            failed(error)
            time.sleep(FAILED_PAUSE_S)
        else:
            return


def beside(node: Node, callback: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """A callback of a service that runs in a thread of its own: the one of all topics does not wait for the server."""

    async def answered(request: Any, response: Any) -> Any:
        done: Future[Any] = Future(executor=node.executor)

        def run() -> None:
            try:
                done.set_result(callback(request, response))
            except Exception as error:
                node.get_logger().error(f"a service failed: {error!r}")
                done.set_result(response)
            executor = node.executor
            if executor is not None:
                executor.wake()

        Thread(target=run, daemon=True).start()
        return await done

    return answered
