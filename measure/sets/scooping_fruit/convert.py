"""python3 convert.py user_performance_data OUT"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from scooping import convert  # noqa: E402

if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]), "Hand_FT", "Tool_FT")
