"""Encoding of movies: MP4 (H.264, yuv420p, which browsers play), or GIF without ffmpeg."""

import itertools
from collections.abc import Iterable
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from viscotrain import files

# A rate factor of 18 cannot be told from the original; the index in front lets browsers start at
# once; one thread and no version in the file make the same bytes everywhere.
ENCODING = "-crf 20 -preset veryfast -threads 1 -movflags +faststart -bitexact"
GIF_COLOURS = 64


def ffmpeg() -> str | None:
    """Path of the program that makes MP4, or None where there is none."""
    try:
        return imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError:
        return None


def write(frames: Iterable[NDArray], stem: Path, *, frame_rate: float) -> Path:
    """Write a movie as `stem`.mp4, or as `stem`.gif where there is no ffmpeg; its path.

    Args:
        frames: Of bytes, shape (height, width, 4): RGBA.
        stem: Path without an ending.
        frame_rate: Frames per second.
    """
    own, ending = (_write_mp4, "mp4") if ffmpeg() else (_write_gif, "gif")
    path = stem.with_name(f"{stem.name}.{ending}")
    with files.whole(path) as part:
        own(frames, part, frame_rate)
    return path


def _write_mp4(frames: Iterable[NDArray], path: Path, frame_rate: float):
    frames = iter(frames)
    first = next(frames)
    height, width = first.shape[:2]
    film_strip = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        pix_fmt_in="rgba",
        pix_fmt_out="yuv420p",
        fps=frame_rate,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        output_params=ENCODING.split(),
    )
    film_strip.send(None)
    for frame in itertools.chain([first], frames):
        film_strip.send(np.ascontiguousarray(frame))
    film_strip.close()


def _write_gif(frames: Iterable[NDArray], path: Path, frame_rate: float):
    images = (
        Image.fromarray(frame).convert("RGB").quantize(GIF_COLOURS, dither=Image.Dither.NONE)
        for frame in frames
    )
    next(images).save(
        path,
        save_all=True,
        append_images=images,
        duration=round(1000 / frame_rate),
        loop=0,
    )
