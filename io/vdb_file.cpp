#include "pavel/io/vdb_file.h"

#include <openvdb/tools/Diagnostics.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "pavel/core/error.h"
#include "pavel/io/vdb_grids.h"
#include "pavel/vdb/level_set_mesh.h"
#include "pavel/vdb/packed_grids.h"

namespace pavel {
namespace {

using openvdb::FloatGrid;

/// Half width 3, whatever the band was in work.
void cutToBand(openvdb::FloatTree& tree) {
    if (tree.background() <= kResultBand) return;
    for (auto leaf = tree.beginLeaf(); leaf; ++leaf)
        for (openvdb::Index v = 0; v < openvdb::FloatTree::LeafNodeType::SIZE; ++v) {
            const float d = leaf->getValue(v);
            if (std::abs(d) < kResultBand) continue;
            leaf->setValueOff(v, d < 0 ? -kResultBand : kResultBand);
        }
    tree.root().setBackground(kResultBand, false);
}

/// Scales voxels to scene units and sets what other programs look for.
FloatGrid::Ptr finished(FloatGrid::Ptr grid, const std::string& name, const Packing& packing, const VdbOptions& options,
                        std::vector<std::string>& faults) {
    const float h = float(packing.voxelSize);
    cutToBand(grid->tree());
    grid->setTransform(openvdb::math::Transform::createLinearTransform(packing.voxelSize));
    openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid->tree());
    leaves.foreach ([h](openvdb::FloatTree::LeafNodeType& leaf, size_t) {
        float* values = leaf.buffer().data();
        for (openvdb::Index v = 0; v < openvdb::FloatTree::LeafNodeType::SIZE; ++v) values[v] *= h;
    });
    // Flood filling with the scaled background renews the tiles. Rounding must not take it under the half width.
    const double width = grid->background();
    float background = float(width * packing.voxelSize);
    while (background / packing.voxelSize < width) background = std::nextafter(background, 1e30f);
    grid->tree().root().setBackground(background, false);
    openvdb::tools::signedFloodFill(grid->tree());
    grid->setName(name);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    // The ninth check, of gradients, finds fault with every crease.
    if (const std::string fault = openvdb::tools::checkLevelSet(*grid, 8); !fault.empty())
        faults.push_back("the level set \"" + name + "\" is not clean: " + fault);
    grid->setSaveFloatAsHalf(options.half);
    grid->setCreator("Pavel " + std::string(version()));
    return grid;
}

std::string elementName(size_t i) {
    char name[32];
    std::snprintf(name, sizeof name, "element_%05zu", i + 1);
    return name;
}

/// A grid that is made when a file asks for it and dropped when it is written: a file of many takes the memory of one.
/// OpenVDB's archive asks for a copy first, to add statistics to its metadata, then writes topology and buffers.
class LateGrid : public FloatGrid {
  public:
    LateGrid(const std::string& name, const VdbOptions& options, std::function<FloatGrid::Ptr()> make)
        : make_(std::move(make)), empty_(treePtr()) {
        setName(name);
        setGridClass(openvdb::GRID_LEVEL_SET);
        setSaveFloatAsHalf(options.half);
    }
    openvdb::GridBase::ConstPtr copyGrid() const override {
        const FloatGrid::Ptr made = make_();
        auto* self = const_cast<LateGrid*>(this);
        self->setTree(made->treePtr());
        self->setTransform(made->transformPtr());
        return made;
    }
    void writeBuffers(std::ostream& out) const override {
        FloatGrid::writeBuffers(out);
        // The very tree that was there before: the archive knows trees that it has written by their addresses.
        const_cast<LateGrid*>(this)->setTree(empty_);
    }

  private:
    std::function<FloatGrid::Ptr()> make_;
    openvdb::FloatTree::Ptr empty_;
};

openvdb::GridPtrVecPtr readGrids(const std::string& path) {
    openvdb::initialize();
    if (!std::filesystem::exists(path)) throw InputError(path + ": no such file");
    try {
        openvdb::io::File file(path);
        file.open(false);
        return file.getGrids();
    } catch (const std::exception& e) {
        throw InputError(path + ": is not a readable .vdb file (" + e.what() + ")");
    }
}

}  // namespace

void writeGrids(const std::string& path, const openvdb::GridPtrVec& grids, const VdbOptions& options) {
    openvdb::MetaMap meta;
    meta.insertMeta("program", openvdb::StringMetadata("Pavel"));
    meta.insertMeta("version", openvdb::StringMetadata(version()));
    meta.insertMeta("units", openvdb::StringMetadata(options.units));
    meta.insertMeta("scene_digest", openvdb::StringMetadata(options.digest));
    try {
        openvdb::io::File file(path);
        file.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
        file.write(grids, meta);
        file.close();
    } catch (const std::exception& e) {
        throw RunError(path + ": writing failed (" + e.what() + ")");
    }
    // OpenVDB writes a random UUID at byte 21; readers want its 8-4-4-4-12 form.
    const std::string d = options.digest;
    const std::string uuid =
        d.substr(0, 8) + "-" + d.substr(8, 4) + "-" + d.substr(12, 4) + "-" + d.substr(16, 4) + "-" + d.substr(20, 12);
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(21);
    file.write(uuid.data(), std::streamsize(uuid.size()));
    file.flush();
    if (!file) throw RunError(path + ": writing failed");
}

std::vector<std::string> writeDecorationVdb(const std::string& path, Packing& packing, const VdbOptions& options) {
    std::vector<std::string> faults;
    openvdb::GridPtrVec grids;
    const auto take = [&](openvdb::FloatTree::Ptr& tree, const char* name) {
        auto grid = finished(FloatGrid::create(tree), name, packing, options, faults);
        tree.reset();
        grids.push_back(grid);
        return grid;
    };
    const FloatGrid::Ptr surface = take(packing.grids->surface, "surface");
    take(packing.grids->base, "base");
    if (options.fog) {
        const FloatGrid::Ptr fog = surface->deepCopy();
        fog->setName("density");
        openvdb::tools::sdfToFogVolume(*fog);
        grids.push_back(fog);
    }
    writeGrids(path, grids, options);
    return faults;
}

void writeElementIdVdb(const std::string& path, const Packing& packing, const VdbOptions& options) {
    auto grid = openvdb::Int32Grid::create(packing.grids->ids);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(packing.voxelSize));
    grid->setName("element_id");
    grid->setCreator("Pavel " + std::string(version()));
    writeGrids(path, {grid}, options);
}

std::vector<std::string> writeElementsVdb(const std::string& path, const Packing& packing,
                                          const std::vector<std::string>& kindOfElement, const VdbOptions& options) {
    std::vector<std::string> faults;
    openvdb::GridPtrVec grids;
    for (size_t i = 0; i < packing.grids->elements.size(); ++i) {
        if (packing.grids->elements[i].empty()) continue;
        grids.push_back(std::make_shared<LateGrid>(elementName(i), options, [&, i] {
            auto grid =
                finished(toFloatGrid(*packing.grids->elements[i].tree()), elementName(i), packing, options, faults);
            grid->insertMeta("id", openvdb::Int32Metadata(int(i) + 1));
            grid->insertMeta("kind", openvdb::StringMetadata(kindOfElement[i]));
            grid->insertMeta("volume", openvdb::DoubleMetadata(packing.elements[i].finalVolume));
            return grid;
        }));
    }
    writeGrids(path, grids, options);
    return faults;
}

TriangleMesh readVdbSurface(const std::string& path) {
    TriangleMesh all;
    const auto grids = readGrids(path);
    bool hasSurface = false;
    for (const auto& g : *grids) hasSurface |= g->getName() == "surface";
    for (const auto& g : *grids) {
        const auto f = openvdb::gridPtrCast<FloatGrid>(g);
        if (!f || f->getGridClass() != openvdb::GRID_LEVEL_SET) continue;
        if (hasSurface && g->getName() != "surface" && g->getName() != "base") continue;
        append(all, levelSetMesh(*f, 1));
    }
    if (all.triangles.empty()) throw InputError(path + ": holds no level set to show");
    return all;
}

std::vector<VdbGridInfo> vdbInfo(const std::string& path) {
    std::vector<VdbGridInfo> infos;
    const auto grids = readGrids(path);
    for (const auto& g : *grids) {
        VdbGridInfo i;
        i.name = g->getName();
        i.type = g->valueType();
        i.gridClass = openvdb::GridBase::gridClassToString(g->getGridClass());
        i.voxelSize = g->voxelSize()[0];
        i.activeVoxels = g->activeVoxelCount();
        i.bytes = g->memUsage();
        const CoordBBox box = g->evalActiveVoxelBoundingBox();
        if (!box.empty()) {
            i.bounds.add(fromVdb(g->indexToWorld(box.min())));
            i.bounds.add(fromVdb(g->indexToWorld(box.max())));
        }
        infos.push_back(i);
    }
    return infos;
}

}  // namespace pavel
