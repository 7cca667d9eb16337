"""A functional mock-up unit (FMI 2.0 or 3.0) as a model, run by FMPy in a process of its own.

An FMU is native code: opening it runs it. It is unpacked once per worker, and workers are replaced after some
hundred runs, because units leak instances. Needs the extra `fmi`.
"""

import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import StudyError
from workbench.models.histories import History
from workbench.models.protocol import ModelSpec
from workbench.system.archive import unpack
from workbench.system.confined import confined

__all__ = ["FmuModel"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuModel:
    """An unpacked unit. `variables` and `outputs` map our names to the unit's."""

    folder: Path
    description: Any
    variables: Mapping[str, str]
    outputs: Mapping[str, str]
    spec: ModelSpec

    @classmethod
    def opened(cls, spec: ModelSpec) -> "FmuModel":
        """Unpack the unit and look up its variables.

        Raises:
            StudyError: FMPy is missing, the file is no FMU, or a variable is not in it.
        """
        try:
            from fmpy import read_model_description
        except ImportError:
            raise StudyError("model kind 'fmu' needs FMPy: pip install 'holdfast[fmi]'") from None
        name = spec.options["file"]
        path = confined(Path(spec.folder), name, what="FMU")
        if not path.is_file():
            raise StudyError(f"no FMU {path}: [model] file is looked up beside the study file")
        folder = Path(tempfile.mkdtemp(prefix="holdfast-fmu-"))
        try:
            unpack(path, folder, what=f"FMU {name}")
            try:
                description = read_model_description(str(folder))
            except Exception as exc:  # whatever a malformed description makes the parser raise
                raise StudyError(f"FMU {name} has no usable model description: {exc}") from None
            known = [v.name for v in description.modelVariables]
            variables = {n: spec.options.get("variables", {}).get(n, n) for n in spec.names}
            named = dict.fromkeys((*spec.responses, *spec.options.get("keep", ())))
            outputs = {n: spec.options.get("outputs", {}).get(n, n) for n in named}
            for variable in (*variables.values(), *outputs.values()):
                if variable not in known:
                    shown = ", ".join(known[:12])
                    raise StudyError(f"FMU {name} has no variable {variable!r}; it has {shown}")
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        return cls(folder=folder, description=description, variables=variables, outputs=outputs, spec=spec)

    def run(self, row: Mapping[str, Any], workdir: Path | None) -> dict[str, Any]:
        """Simulate; every response and kept output as a history, or its last value without a reduction."""
        from fmpy import simulate_fmu

        options = self.spec.options
        result = simulate_fmu(
            str(self.folder),
            model_description=self.description,
            start_values={self.variables[name]: value for name, value in row.items()},
            stop_time=options["stop_time"],
            output_interval=options.get("step"),
            output=list(dict.fromkeys(self.outputs.values())),
        )
        time = [float(t) for t in result["time"]]
        found: dict[str, Any] = {}
        for name, variable in self.outputs.items():
            values = [float(v) for v in result[variable]]
            is_number = name in self.spec.responses and self.spec.responses[name] is None
            found[name] = values[-1] if is_number else History(time, values)
        return found

    def close(self) -> None:
        """Remove the unpacked unit."""
        shutil.rmtree(self.folder, ignore_errors=True)
