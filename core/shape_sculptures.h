#pragma once
// The makers of the larger bases, one file each; parameters arrive within range.
#include "pavel/core/mesh.h"

namespace pavel {

/// Newell's teapot as a solid with its lid on: body and lid are "outer"; also "knob", "spout", "handle", "other" (the
/// bottom and the groove around the lid), "hidden".
TriangleMesh makeTeapot(double height);
/// A carnival mask, thickened inward from its sheet, "outer".
TriangleMesh makeMask(double thickness);
/// The mask with a plague doctor's "beak".
TriangleMesh makePlagueMask(double thickness);
/// A sitting rabbit that looks along +x; "outer" is its fur, "eyes" are eyes and nose, "hidden".
TriangleMesh makeRabbit(double height);
/// A flat disc below z = 0 with an eyelet; its flat top is "outer".
TriangleMesh makePendant(double radius, double thickness);

}  // namespace pavel
