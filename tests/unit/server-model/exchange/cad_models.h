#pragma once
// CAD files as other programs write them, made by Open CASCADE for the tests of import and export.

#include <Geom_BSplineSurface.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <filesystem>
#include <string>
#include <vector>

namespace handloft::exchange::test {

/// A bicubic sheet of n x n control points over [0, size] x [0, size], bulging like sin(x) sin(y) by `bulge`;
/// its border is straight.
Handle(Geom_BSplineSurface) sheet(int n, double size, double bulge);

/// A closed box of six faces, the top of which is a sheet: one solid.
TopoDS_Shape box_with_freeform_top(double size, double bulge);

/// A tube along z, cubic and periodic in u, smooth across its seam; radius and height in the file's unit.
TopoDS_Face periodic_tube(double radius, double height);

/// A whole sphere as a rational B-spline: two poles and a seam.
TopoDS_Face rational_sphere(double radius);

/// A sheet with a circular and a square hole.
TopoDS_Face sheet_with_two_holes(double size, double bulge);

/// Units as STEP writes them: "MM", "INCH". One product a shape.
void write_step_file(const std::filesystem::path& path, const std::vector<TopoDS_Shape>& shapes,
                     const std::string& unit = "MM");
void write_iges_file(const std::filesystem::path& path, const std::vector<TopoDS_Shape>& shapes);

}  // namespace handloft::exchange::test
