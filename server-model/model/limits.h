#pragma once
// How large a document may grow. Every operation is checked against these, so that no client, script or file
// can make the server allocate without bound (F2 in the reliability figures).

#include <cstddef>
#include <cstdint>

namespace handloft::model {

struct Limits {
  std::size_t max_entities = 4096;   ///< Alive at one time.
  std::size_t max_used_ids = 65536;  ///< Ids are never reused, so the used ones are remembered.
  std::size_t max_id_bytes = 64;     ///< As operation.proto promises.
  std::size_t max_name_bytes = 256;  ///< UTF-8; shown in one line.
  std::size_t max_points_per_operation = 1'000'000;
  std::size_t max_curves_per_operation = 64;  ///< Of a profile: each may look at every shape.
  std::size_t max_points_per_shape = 2'000'000;
  std::uint32_t max_strokes_per_shape = 1'000'000;
  std::size_t max_points_per_query = 2'000'000;
  std::size_t max_alternatives = 64;  ///< Of a document (A28).
  std::size_t max_versions = 1024;    ///< Named ones (U6); each shares what it has with others.
  std::size_t max_version_name_bytes = 64;
  std::size_t max_note_bytes = 4096;             ///< Of a version.
  std::size_t max_comments = 4096;               ///< Of a document, answers among them (U6).
  std::size_t max_comment_bytes = 4096;          ///< Of one's text.
  std::size_t max_reference_vertices = 300'000;  ///< Of one mesh, so that it goes to a viewer in one message.
  std::size_t max_reference_triangles = 600'000;
  double max_coordinate_m = 1e4;            ///< 10 km: beyond any workspace; keeps squares far from overflow.
  double min_superellipse_exponent = 0.2;   ///< A22
  double max_superellipse_exponent = 20.0;  ///< A22
  std::size_t max_boundary_points = 20'000;    ///< Of a trimming curve (A24): ten minutes of drawing.
  std::size_t max_disk_poses = 20'000;         ///< Of one push (A14): nearly four minutes at 90 Hz.
  double max_disk_radius_m = 1.0;              ///< Of the disk (A13); a hand has 0.06.
  std::uint32_t max_degree = 6;                ///< A4
  std::uint32_t default_degree = 2;            ///< A4: what degree 0 in CreateDualShape means.
  std::size_t max_control_points = 1'050'000;  ///< Of one sculpted surface (D21's largest: a million).
  std::size_t max_icons = 256;                 ///< Of one sculpted surface.
  std::size_t max_icon_corners = 2'000;        ///< Of a curve icon, as drawn.
  std::size_t max_icon_bends = 256;            ///< Of one curve icon, until it is committed.
  std::size_t max_icon_sensors = 16;           ///< Of one icon.
  std::size_t max_constraint_rows = 3'000;     ///< Of all of a surface's icons: a dense system of that size.
  std::size_t max_model_bytes = 256U << 20;    ///< Of an imported CAD model.
  std::size_t max_model_faces = 4'000;         ///< Sculptable ones; each is an entity.
  std::size_t max_trim_curves = 20'000;        ///< Of one face.
  std::size_t max_history_steps = 10'000;      ///< Then some are forgotten (history.h).
  std::size_t max_provisional = 64;            ///< Gestures in the air at one time.
};

}  // namespace handloft::model
