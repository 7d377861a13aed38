// Single-thread rates of Embree for the surface and the rays that the bench `caster` hands over: reads one file, prints
// one line a method with build milliseconds and Mray/s of each kind of rays by the CPU time of this thread.
//
// File, little-endian: u32 columns, u32 rows, f32 spacing, f32 x0, f32 z0, heights (row-major, f32), u32 kinds, and for
// each kind u32 rays and six f32 a ray (origin, direction).

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#define MENISCUS_EMBREE 4
#else
#include <embree3/rtcore.h>
#define MENISCUS_EMBREE 3
#endif

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>
#include <vector>

namespace {

struct Ray {
    float o[3], d[3];
};

double cpu_seconds(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

template <class T> T read(std::ifstream &in) {
    T value{};
    in.read(reinterpret_cast<char *>(&value), sizeof value);
    if (!in) {
        std::fprintf(stderr, "the file ends too soon\n");
        std::exit(1);
    }
    return value;
}

constexpr int SPANS = 7;
constexpr double SPAN = 0.1;

// Least CPU seconds a call, over several spans of calls.
template <class F> double best(F work, clockid_t clock = CLOCK_THREAD_CPUTIME_ID) {
    double least = std::numeric_limits<double>::infinity();
    for (int s = 0; s < SPANS; ++s) {
        const double start = cpu_seconds(clock);
        double calls = 0.0, used = 0.0;
        do {
            work();
            calls += 1.0;
            used = cpu_seconds(clock) - start;
        } while (used < SPAN);
        least = std::min(least, used / calls);
    }
    return least;
}

unsigned sink = 0;

void one_by_one(RTCScene scene, const std::vector<Ray> &rays) {
#if MENISCUS_EMBREE == 3
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
#endif
    for (const Ray &r : rays) {
        RTCRayHit q{};
        q.ray.org_x = r.o[0], q.ray.org_y = r.o[1], q.ray.org_z = r.o[2];
        q.ray.dir_x = r.d[0], q.ray.dir_y = r.d[1], q.ray.dir_z = r.d[2];
        q.ray.tnear = 1e-3f, q.ray.tfar = std::numeric_limits<float>::infinity();
        q.ray.mask = ~0u;
        q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if MENISCUS_EMBREE == 3
        rtcIntersect1(scene, &context, &q);
#else
        rtcIntersect1(scene, &q);
#endif
        sink += q.hit.primID;
    }
}

void in_packets(RTCScene scene, const std::vector<Ray> &rays) {
#if MENISCUS_EMBREE == 3
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
#endif
    alignas(32) int valid[8];
    std::fill(valid, valid + 8, -1);
    for (std::size_t first = 0; first + 8 <= rays.size(); first += 8) {
        alignas(32) RTCRayHit8 q{};
        for (int k = 0; k < 8; ++k) {
            const Ray &r = rays[first + k];
            q.ray.org_x[k] = r.o[0], q.ray.org_y[k] = r.o[1], q.ray.org_z[k] = r.o[2];
            q.ray.dir_x[k] = r.d[0], q.ray.dir_y[k] = r.d[1], q.ray.dir_z[k] = r.d[2];
            q.ray.tnear[k] = 1e-3f, q.ray.tfar[k] = std::numeric_limits<float>::infinity();
            q.ray.mask[k] = ~0u;
            q.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        }
#if MENISCUS_EMBREE == 3
        rtcIntersect8(valid, scene, &context, &q);
#else
        rtcIntersect8(valid, scene, &q);
#endif
        sink += q.hit.primID[0];
    }
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: embree_rates FILE\n");
        return 2;
    }
    std::ifstream in(argv[1], std::ios::binary);
    const auto columns = read<std::uint32_t>(in), rows = read<std::uint32_t>(in);
    const float spacing = read<float>(in), x0 = read<float>(in), z0 = read<float>(in);
    std::vector<float> heights(std::size_t(columns) * rows);
    in.read(reinterpret_cast<char *>(heights.data()), std::streamsize(4 * heights.size()));
    std::vector<std::vector<Ray>> kinds(read<std::uint32_t>(in));
    for (auto &rays : kinds) {
        rays.resize(read<std::uint32_t>(in));
        in.read(reinterpret_cast<char *>(rays.data()), std::streamsize(sizeof(Ray) * rays.size()));
    }
    if (!in) {
        std::fprintf(stderr, "the file ends too soon\n");
        return 1;
    }

    RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
    const bool packets = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;
    for (const bool grid : {false, true}) {
        RTCScene scene = nullptr;
        const auto build = [&] {
            if (scene)
                rtcReleaseScene(scene);
            scene = rtcNewScene(device);
            rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
            rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
            RTCGeometry g =
                rtcNewGeometry(device, grid ? RTC_GEOMETRY_TYPE_GRID : RTC_GEOMETRY_TYPE_TRIANGLE);
            auto *v = static_cast<float *>(rtcSetNewGeometryBuffer(
                g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, heights.size()));
            for (std::uint32_t j = 0, k = 0; j < rows; ++j)
                for (std::uint32_t i = 0; i < columns; ++i, ++k) {
                    v[3 * k] = x0 + spacing * float(i);
                    v[3 * k + 1] = heights[k];
                    v[3 * k + 2] = z0 + spacing * float(j);
                }
            if (grid) {
                auto *one = static_cast<RTCGrid *>(rtcSetNewGeometryBuffer(
                    g, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), 1));
                one->startVertexID = 0;
                one->stride = columns;
                one->width = std::uint16_t(columns);
                one->height = std::uint16_t(rows);
            } else {
                const std::size_t cells = std::size_t(columns - 1) * (rows - 1);
                auto *t = static_cast<std::uint32_t *>(rtcSetNewGeometryBuffer(
                    g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, 2 * cells));
                for (std::uint32_t j = 0; j + 1 < rows; ++j)
                    for (std::uint32_t i = 0; i + 1 < columns; ++i) {
                        const std::uint32_t a = j * columns + i, b = a + 1, c = a + columns, d = c + 1;
                        const std::uint32_t six[6] = {a, d, b, a, c, d};
                        t = std::copy(six, six + 6, t);
                    }
            }
            rtcCommitGeometry(g);
            rtcAttachGeometry(scene, g);
            rtcReleaseGeometry(g);
            rtcCommitScene(scene);
        };
        // Embree may build on threads of its own: the time of all of them.
        const double built = best(build, CLOCK_PROCESS_CPUTIME_ID);
        for (const bool eight : {false, true}) {
            if (eight && !packets)
                continue;
            std::printf("embree%d %s%s\t%.3f", MENISCUS_EMBREE, grid ? "grid" : "triangles", eight ? " x8" : "",
                        1e3 * built);
            for (const auto &rays : kinds) {
                const double seconds =
                    best([&] { eight ? in_packets(scene, rays) : one_by_one(scene, rays); });
                std::printf("\t%.4f", double(rays.size()) / seconds / 1e6);
            }
            std::printf("\n");
        }
        rtcReleaseScene(scene);
    }
    rtcReleaseDevice(device);
    return sink == 1 ? 3 : 0;
}
