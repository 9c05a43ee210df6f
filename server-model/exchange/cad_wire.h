#pragma once
// How the values of cad_job.h stand in bytes: one list of fields for both directions. Not for others than
// cad_job.

#include <Eigen/Core>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "server-model/exchange/cad_kernel.h"
#include "server-model/geometry/bspline_surface.h"

namespace handloft::exchange::detail {

template <typename T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;

template <typename T, typename Kind>
concept Of = std::same_as<std::remove_const_t<T>, Kind>;

/// What a value is before it is read; types without an empty value say theirs.
template <typename T>
T blank() {
  return T();
}
template <>
inline geometry::KnotVector blank() {
  return *geometry::KnotVector::uniform(1, 2);
}
template <>
inline geometry::BSplineSurface blank() {
  return {blank<geometry::KnotVector>(), blank<geometry::KnotVector>(), {}, {}};
}
template <>
inline CadFace blank() {
  return {{}, blank<geometry::BSplineSurface>(), {}, false};
}
template <>
inline ImportedFace blank() {
  return {0, blank<CadFace>()};
}
template <>
inline ReplacedFace blank() {
  return {0, blank<geometry::BSplineSurface>()};
}
template <>
inline TrimCurve blank() {
  return {blank<geometry::KnotVector>(), {}, {}};
}

class WireWriter {
 public:
  static constexpr bool reads = false;

  template <typename T>
  void operator()(const T& value) {
    write(value);
  }
  std::string take() { return std::move(bytes_); }

 private:
  void raw(const void* from, std::size_t count) { bytes_.append(static_cast<const char*>(from), count); }
  template <Plain T>
  void write(const T& value) {
    raw(&value, sizeof value);
  }
  template <int Rows, int Columns>
  void write(const Eigen::Matrix<double, Rows, Columns>& value) {
    raw(value.data(), sizeof(double) * static_cast<std::size_t>(value.size()));
  }
  void write(const std::string& value) {
    write(static_cast<std::uint64_t>(value.size()));
    raw(value.data(), value.size());
  }
  void write(const std::filesystem::path& value) { write(value.string()); }
  template <typename T>
  void write(const std::vector<T>& values) {
    write(std::span<const T>(values));
  }
  template <typename T>
  void write(const std::span<const T>& values) {
    write(static_cast<std::uint64_t>(values.size()));
    for (const T& value : values) (*this)(value);
  }
  template <typename T>
  void write(const T& value) {
    fields(*this, value);
  }

  std::string bytes_;
};

/// Takes values from the front of bytes; after it ran out, or found what cannot be, all are blank.
class WireReader {
 public:
  static constexpr bool reads = true;

  explicit WireReader(std::string_view bytes) : rest_(bytes) {}

  template <typename T>
  void operator()(T& value) {
    read(value);
  }
  void fail() { failed_ = true; }
  bool failed() const { return failed_; }
  bool at_end() const { return rest_.empty(); }

 private:
  void raw(void* to, std::size_t count) {
    failed_ = failed_ || count > rest_.size();
    if (failed_ || count == 0) return;
    std::memcpy(to, rest_.data(), count);
    rest_.remove_prefix(count);
  }
  template <Plain T>
  void read(T& value) {
    raw(&value, sizeof value);
  }
  void read(bool& value) {
    unsigned char byte = 0;
    raw(&byte, 1);
    value = byte != 0;
  }
  template <int Rows, int Columns>
  void read(Eigen::Matrix<double, Rows, Columns>& value) {
    raw(value.data(), sizeof(double) * static_cast<std::size_t>(value.size()));
  }
  void read(std::string& value) {
    std::uint64_t count = 0;
    read(count);
    failed_ = failed_ || count > rest_.size();
    if (failed_) return;
    value = rest_.substr(0, count);
    rest_.remove_prefix(count);
  }
  void read(std::filesystem::path& value) {
    std::string text;
    read(text);
    value = text;
  }
  template <typename T>
  void read(std::vector<T>& values) {
    std::uint64_t count = 0;
    read(count);
    failed_ = failed_ || count > rest_.size();  // Each takes a byte at the least.
    values.clear();
    if constexpr (Plain<T>) {
      if (!failed_ && count <= rest_.size() / sizeof(T)) values.reserve(count);
    }
    for (std::uint64_t i = 0; i < count && !failed_; ++i) (*this)(values.emplace_back(blank<T>()));
  }
  template <typename T>
  void read(T& value) {
    fields(*this, value);
  }

  std::string_view rest_;
  bool failed_ = false;
};

// The fields of each type, for both.

template <typename Wire, Of<Duration> T>
void fields(Wire& wire, T& duration) {
  std::int64_t count = duration.count();
  wire(count);
  if constexpr (Wire::reads) duration = Duration(count);
}

template <typename Wire, Of<Error> T>
void fields(Wire& wire, T& error) {
  wire(error.code);
  wire(error.message);
  wire(error.field);
  if constexpr (Wire::reads) {
    if (error.code < ErrorCode::invalid_argument || error.code > ErrorCode::internal) wire.fail();
  }
}

template <typename Wire, Of<geometry::KnotVector> T>
void fields(Wire& wire, T& value) {
  int degree = value.degree();
  bool periodic = value.is_periodic();
  std::vector<double> knots;
  if constexpr (!Wire::reads) knots = value.knots();
  wire(degree);
  wire(periodic);
  wire(knots);
  if constexpr (Wire::reads) {
    auto made = periodic ? geometry::KnotVector::periodic(degree, std::move(knots))
                         : geometry::KnotVector::open(degree, std::move(knots));
    if (!made) return wire.fail();
    value = std::move(*made);
  }
}

template <typename Wire, Of<geometry::BSplineSurface> T>
void fields(Wire& wire, T& surface) {
  wire(surface.u);
  wire(surface.v);
  wire(surface.control);
  wire(surface.weights);
}

template <typename Wire, Of<geometry::Box2> T>
void fields(Wire& wire, T& box) {
  wire(box.centre);
  wire(box.half_extent);
}

template <typename Wire, Of<geometry::PolynomialSurface> T>
void fields(Wire& wire, T& surface) {
  int degree = surface.degree();
  geometry::Box2 box;
  if constexpr (!Wire::reads) box = surface.box();
  std::vector<double> coefficients(surface.scaled_coefficients().begin(),
                                   surface.scaled_coefficients().end());
  wire(degree);
  wire(box);
  wire(coefficients);
  if constexpr (Wire::reads) {
    auto made = geometry::PolynomialSurface::from_scaled(degree, box, coefficients);
    if (!made) return wire.fail();
    surface = *made;
  }
}

template <typename Wire, Of<geometry::Superellipse> T>
void fields(Wire& wire, T& shape) {
  geometry::Box2 box;
  if constexpr (!Wire::reads) box = shape.box();
  double exponent = shape.exponent();
  wire(box);
  wire(exponent);
  if constexpr (Wire::reads) {
    auto made = geometry::Superellipse::create(box, exponent);
    if (!made) return wire.fail();
    shape = *made;
  }
}

template <typename Wire, Of<geometry::PlanarFace> T>
void fields(Wire& wire, T& face) {
  wire(face.outer);
  wire(face.holes);
}

template <typename Wire, Of<geometry::Frame> T>
void fields(Wire& wire, T& frame) {
  wire(frame.origin);
  wire(frame.rotation);
}

template <typename Wire, Of<SurfaceExport> T>
void fields(Wire& wire, T& surface) {
  wire(surface.name);
  wire(surface.surface);
  wire(surface.frame);
  wire(surface.superellipse);
  wire(surface.trim);
  wire(surface.region);
}

template <typename Wire, Of<TrimCurve> T>
void fields(Wire& wire, T& curve) {
  wire(curve.knots);
  wire(curve.control);
  wire(curve.weights);
}

template <typename Wire, Of<CadFace> T>
void fields(Wire& wire, T& face) {
  wire(face.name);
  wire(face.surface);
  wire(face.loops);
  wire(face.reversed);
}

template <typename Wire, Of<ImportedFace> T>
void fields(Wire& wire, T& face) {
  wire(face.number);
  wire(face.face);
}

template <typename Wire, Of<ReplacedFace> T>
void fields(Wire& wire, T& face) {
  wire(face.number);
  wire(face.surface);
}

template <typename Wire, Of<ModelExport> T>
void fields(Wire& wire, T& model) {
  wire(model.name);
  if constexpr (Wire::reads) {
    std::string bytes;
    wire(bytes);
    model.boundary_representation = std::make_shared<const std::string>(std::move(bytes));
  } else {
    wire(model.boundary_representation ? *model.boundary_representation : std::string());
  }
  wire(model.metres_per_unit);
  wire(model.translation);
  wire(model.replaced);
  wire(model.removed);
  wire(model.border_tolerance_m);
}

template <typename Wire, Of<BorderGap> T>
void fields(Wire& wire, T& gap) {
  wire(gap.model);
  wire(gap.face);
  wire(gap.neighbour);
  wire(gap.face_name);
  wire(gap.neighbour_name);
  wire(gap.gap_m);
}

template <typename Wire, Of<StepOptions> T>
void fields(Wire& wire, T& options) {
  wire(options.author);
  wire(options.organization);
  wire(options.contour_tolerance);
}

template <typename Wire, Of<CadText> T>
void fields(Wire& wire, T& text) {
  wire(text.text);
  wire(text.gaps);
}

template <typename Wire, Of<CadImportOptions> T>
void fields(Wire& wire, T& options) {
  wire(options.translation);
  wire(options.max_file_bytes);
  wire(options.max_model_bytes);
  wire(options.max_faces);
  wire(options.max_all_faces);
  wire(options.max_control_points);
  wire(options.max_trim_curves);
  wire(options.max_coordinate_m);
  wire(options.max_vertices);
  wire(options.max_triangles);
  wire(options.chord_tolerance_m);
  wire(options.chord_fraction);
}

template <typename Wire, Of<ReferenceOptions> T>
void fields(Wire& wire, T& options) {
  wire(options.scale);
  wire(options.up);
  wire(options.translation);
  wire(options.max_file_bytes);
  wire(options.max_vertices);
  wire(options.max_triangles);
  wire(options.max_coordinate_m);
  wire(options.weld_tolerance);
  wire(options.chord_tolerance_m);
  wire(options.chord_fraction);
}

template <typename Wire, Of<ImportedModel> T>
void fields(Wire& wire, T& model) {
  wire(model.boundary_representation);
  wire(model.metres_per_unit);
  wire(model.face_count);
  wire(model.faces);
  wire(model.rest_positions);
  wire(model.rest_indices);
  wire(model.notes);
}

template <typename Wire, Of<ImportedReference> T>
void fields(Wire& wire, T& reference) {
  wire(reference.positions);
  wire(reference.indices);
  wire(reference.welded_vertices);
  wire(reference.dropped_triangles);
  wire(reference.lower);
  wire(reference.upper);
}

}  // namespace handloft::exchange::detail
