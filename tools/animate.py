"""Puts frames (PNG, in the order of their names) together to an animated WebP: animate.py FOLDER OUT.webp"""

import sys
from pathlib import Path

from PIL import Image

FRAME_MS = 180
LAST_MS = 3000
WIDTH = 720


def main() -> None:
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    frames = []
    for path in sorted(folder.glob("*.png")):
        frame = Image.open(path).convert("RGB")
        height = round(frame.height * WIDTH / frame.width)
        frames.append(frame.resize((WIDTH, height), Image.Resampling.LANCZOS))
    if not frames:
        sys.exit(f"animate.py: {folder} has no PNG files")
    times = [FRAME_MS] * (len(frames) - 1) + [LAST_MS]
    frames[0].save(out, save_all=True, append_images=frames[1:], duration=times, loop=0, quality=72, method=6)
    print(f"{out}: {len(frames)} frames, {out.stat().st_size // 1024} KiB")


if __name__ == "__main__":
    main()
