"""Build the wheel, install it in an empty environment, import the four names and run the command there."""

import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
NAMES = {"doe", "studies", "surrogates", "workbench"}


def run(*command: object, cwd: Path) -> str:
    """The command's output; its failure ends this script with that output."""
    done = subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{command}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def main() -> None:
    """Raise SystemExit with the reason when the wheel is not what we promise."""
    with tempfile.TemporaryDirectory() as folder:
        away = Path(folder)
        run(sys.executable, "-m", "build", "--wheel", "--outdir", away, ROOT, cwd=away)
        (wheel,) = away.glob("*.whl")
        top = {name.split("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
        packages = {name for name in top if not name.endswith(".dist-info")}
        if packages != NAMES:
            sys.exit(f"the wheel holds {sorted(packages)}, expected {sorted(NAMES)}")
        venv.create(away / "env", with_pip=True)
        python = away / "env" / "bin" / "python"
        run(python, "-m", "pip", "install", "-q", "-c", ROOT / "constraints.txt", wheel, cwd=away)
        run(python, "-c", "import doe, studies, surrogates, workbench, workbench.engine", cwd=away)
        text = run(away / "env" / "bin" / "holdfast", "--help", cwd=away)
        if "screen" not in text:
            sys.exit(f"holdfast --help does not list its commands:\n{text}")
    print("wheel: four packages, command runs in an empty environment")


if __name__ == "__main__":
    main()
