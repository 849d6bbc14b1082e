"""Types of the package; what everything does stands in `help(btfkit)`."""

from collections.abc import Callable
from os import PathLike
from typing import Any

import numpy
from numpy.typing import NDArray

from ._errors import BtfError as BtfError
from ._errors import InputError as InputError
from ._errors import InternalError as InternalError
from ._errors import IoError as IoError
from ._errors import MissingError as MissingError
from ._errors import RecipeError as RecipeError
from ._errors import StoppedError as StoppedError
from ._errors import UsageError as UsageError

__version__: str
Path = str | PathLike[str]
Direction = tuple[float, float]
Window = tuple[int, int, int, int]
Progress = Callable[[str, int, int], object]
Rgb = NDArray[numpy.float32]
Vectors = NDArray[numpy.float64]

class Measurement:
    def __init__(self, path: Path) -> None: ...
    shape: tuple[int, int, int, int, int]
    channels: list[str]
    views: NDArray[numpy.float64]
    lights: NDArray[numpy.float64]
    views_done: int
    def samples(self, view: int, window: Window | None = None) -> NDArray[Any]: ...
    def image(self, light: Direction, view: Direction = (0, 0), window: Window | None = None) -> Rgb: ...

class Model:
    def __init__(self, path: Path) -> None: ...
    shape: tuple[int, int]
    clusters: int
    views: NDArray[numpy.float64]
    lights: NDArray[numpy.float64]
    def index(self) -> NDArray[numpy.uint16]: ...
    def image(self, light: Direction, view: Direction = (0, 0), window: Window | None = None) -> Rgb: ...
    def value(self, points: Vectors, views: Vectors, lights: Vectors) -> Rgb: ...
    def plane(self, seed: int = 1, jitter: float | None = None) -> Plane: ...

class Plane:
    def window(self, x: int, y: int, width: int, height: int) -> NDArray[numpy.uint32]: ...
    def image(self, window: Window, light: Direction, view: Direction = (0, 0)) -> Rgb: ...
    def value(self, points: Vectors, views: Vectors, lights: Vectors) -> Rgb: ...

class Enlargement:
    def __init__(self, path: Path, model: Path | None = None) -> None: ...
    shape: tuple[int, int]
    def window(self, x: int, y: int, width: int, height: int) -> NDArray[numpy.uint16]: ...
    def source(self, x: int, y: int, width: int, height: int) -> NDArray[numpy.uint32] | None: ...
    def image(self, light: Direction, view: Direction = (0, 0), window: Window | None = None) -> Rgb: ...
    def value(self, points: Vectors, views: Vectors, lights: Vectors) -> Rgb: ...

def import_(
    archive: Path | list[Path],
    measurement: Path,
    *,
    pattern: str | None = None,
    table: Path | None = None,
    order: str | None = None,
    white: float = 1.0,
    progress: Progress | None = None,
    threads: int | None = None,
    memory: int | None = None,
    force: bool = False,
) -> dict[str, Any]: ...
def model(
    measurement: Path,
    model: Path,
    *,
    clusters: int | None = None,
    tile: tuple[int, int] | None = None,
    seed: int = 1,
    progress: Progress | None = None,
    threads: int | None = None,
    memory: int | None = None,
    force: bool = False,
) -> dict[str, Any]: ...
def enlarge(
    model: Path,
    enlargement: Path,
    width: int,
    height: int,
    *,
    seed: int = 1,
    tileable: bool = False,
    progress: Progress | None = None,
    threads: int | None = None,
    memory: int | None = None,
    force: bool = False,
) -> dict[str, Any]: ...
