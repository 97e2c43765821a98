# SPDX-License-Identifier: MIT
"""Limits that have no effect are reported, and only those. Run by pytest; writes to temporary folders."""

from __future__ import annotations

from pathlib import Path

import pytest

from hodograph.pipeline import load_pipeline

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@pytest.mark.parametrize(
    ("profile", "limits", "reported"),
    [
        ('"optimal"', 'policy = "report"', ['policy "report" does nothing']),
        ('"optimal"', 'policy = "respect"\nvolts = 5', []),
        ('"optimal"', "volts = 12", ["volts_limit of 5 V counts"] * 2),
        ('"quintic"\nnominal_mm_s = 20\nramp_time_s = 0.1', 'policy = "report"', []),
        (
            '"optimal"',
            "[[limits.cap]]\nfrom_mm = 0\nto_mm = 500\nfeed_mm_s = 90\n"
            "[[limits.cap]]\nfrom_mm = 400\nto_mm = 500\nfeed_mm_s = 9",
            ["cap 2 begins at 400 mm, after the end"],
        ),
    ],
)
def test_what_has_no_effect_is_reported(
    tmp_path: Path, profile: str, limits: str, reported: list[str]
) -> None:
    file = tmp_path / "path.toml"
    file.write_text(
        "[path]\nclosed = false\ncontrol_points = [[0, 0], [12, 18], [24, 27], [36, 9]]\n"
        f"[feed]\nprofile = {profile}\n"
        f"[limits]\nfeed_mm_s = 100\nacceleration_mm_s2 = 1000\njerk_mm_s3 = 20000\n{limits}\n"
        f'[machine]\nfile = "{EXAMPLES}/machines/paper_alpha.toml"\n'
    )
    pipeline = load_pipeline(file)
    notes = [note for note in pipeline.notes(pipeline.plan) if note.startswith("limits:")]
    assert len(notes) == len(reported)
    assert all(text in note for text, note in zip(reported, notes, strict=True))
