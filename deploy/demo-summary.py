"""Prints what a demonstration left in a folder, in a few lines: demo-summary.py FOLDER"""
import json
import pathlib
import sys


def main(folder: pathlib.Path) -> None:
    tracking = json.loads((folder / "tracking.json").read_text())
    model = json.loads((folder / "model.json").read_text())
    view = json.loads((folder / "view.json").read_text())
    accuracy = tracking["accuracy"]

    cameras = tracking["cameras"]
    print("tracking")
    print("  frames      " + ", ".join(f"{c['name']} {c['frames']} ({c['dropped']} dropped)" for c in cameras))
    print(f"  seen        {sum(c['tags'] for c in cameras)} tags, {sum(c['fingertips'] for c in cameras)} fingertips, "
          f"{tracking['glove_reports']} glove reports")
    tips, position, rotation = (accuracy[k] for k in ("fingertips_mm", "head_position_mm", "head_rotation_deg"))
    print(f"  fingertips  {tips['rms']:.2f} mm RMS from the truth ({tips['count']} positions, "
          f"{accuracy['fingertips_lost']} lost)")
    print(f"  head        {position['rms']:.2f} mm and {rotation['rms']:.3f} degrees RMS from the truth "
          f"({position['count']} poses, {accuracy['heads_lost']} lost)")

    print("model")
    for entity in model["entities"]:
        fit = "not fitted"
        if entity["fitted"]:
            fit = (f"degree {entity['degree']}, residuals {1000 * entity['residual_rms_m']:.2f} mm RMS, "
                   f"{1000 * entity['residual_max_m']:.2f} mm at most")
        print(f"  {entity['name']:<18} {entity['points']} points in {entity['strokes']} strokes, {fit}")
    print(f"  hash        {model['hash']}")

    print("latency from a camera's exposure")
    for name, figures in (("to the socket", tracking["capture_to_publish_ms"]),
                          ("to the client", view["capture_to_client_ms"])):
        median = figures.get("p50", figures.get("median"))
        print(f"  {name:<14} {median:.1f} ms median, {figures['p99']:.1f} ms 99th percentile ({figures['count']})")

    print("files")
    for name in ("mouse.step", "mouse.glb", "view.png", "session.rec"):
        path = folder / name
        print(f"  {path}  {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
