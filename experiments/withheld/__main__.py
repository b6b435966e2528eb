"""The withheld-effect benchmark: generate cases, diagnose them blind, score the verdicts.

python experiments/withheld generate --set dev|test|real --out FOLDER [--cases N] [--seed S] [--data D] [--quick]
"""

from __future__ import annotations

import sys
from pathlib import Path

# In place of this folder, whose modules must not be found under their bare names.
sys.path[0] = str(Path(__file__).resolve().parents[1])

from withheld.commands import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
