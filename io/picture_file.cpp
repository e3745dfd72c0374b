#include "pavel/io/picture_file.h"

#include <png.h>

#include <cstdio>
#include <memory>
// jpeglib.h needs stdio's types before it
#include <jpeglib.h>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"

namespace pavel {
namespace {

bool endsWith(const std::string& text, const std::string& end) {
    return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::vector<uint8_t> opaque(const std::vector<uint8_t>& rgba) {
    std::vector<uint8_t> rgb;
    rgb.reserve(rgba.size() / 4 * 3);
    for (size_t i = 0; i < rgba.size(); i += 4) rgb.insert(rgb.end(), &rgba[i], &rgba[i] + 3);
    return rgb;
}

void writePng(const std::string& path, const Picture& p) {
    bool clear = false;
    for (size_t i = 3; i < p.rgba.size(); i += 4) clear |= p.rgba[i] < 255;
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = unsigned(p.width);
    image.height = unsigned(p.height);
    image.format = clear ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
    const std::vector<uint8_t> pixels = clear ? p.rgba : opaque(p.rgba);
    if (!png_image_write_to_file(&image, path.c_str(), 0, pixels.data(), 0, nullptr))
        throw RunError(path + ": the picture cannot be written (" + image.message + ")");
}

void writeJpeg(const std::string& path, const Picture& p) {
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    // Nothing can fail but memory, and that is the library's to throw: C++ frames are unwound through it.
    errors.error_exit = [](j_common_ptr) { throw RunError("the JPEG encoder failed"); };
    jpeg_create_compress(&jpeg);
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&jpeg, &bytes, &size);
    jpeg.image_width = unsigned(p.width);
    jpeg.image_height = unsigned(p.height);
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 88, TRUE);
    jpeg_start_compress(&jpeg, TRUE);
    std::vector<uint8_t> pixels = opaque(p.rgba);
    while (jpeg.next_scanline < jpeg.image_height) {
        JSAMPROW row = &pixels[size_t(jpeg.next_scanline) * size_t(p.width) * 3];
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    const std::unique_ptr<unsigned char, void (*)(void*)> owned(bytes, std::free);
    writeText(path, std::string(reinterpret_cast<const char*>(bytes), size));
}

}  // namespace

void writePicture(const std::string& path, const Picture& picture) {
    if (endsWith(path, ".png"))
        writePng(path, picture);
    else
        writeJpeg(path, picture);
}

void checkPictureName(const std::string& path) {
    if (!endsWith(path, ".png") && !endsWith(path, ".jpg"))
        throw InputError(path + ": the picture's name must end in .png or .jpg");
}

}  // namespace pavel
