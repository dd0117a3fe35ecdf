/* What the translated kernels stand on: memory of their own, checks, and Python's arithmetic. */
#include <math.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_MSC_VER)
#define SD_THREAD __declspec(thread)
#define ALWAYS_INLINE __forceinline
#else
#define SD_THREAD __thread
#define ALWAYS_INLINE inline __attribute__((always_inline))
#endif

/* The functions with `fma`: the processor's own, in the version for AVX2. It is not given to the others:
 * GCC contracts in alternating lanes (vfmaddsub) whatever -ffp-contract says. */
#if defined(__GNUC__) && defined(__x86_64__) && defined(__AVX2__)
#define SD_FUSES __attribute__((noinline, target("avx2,fma,bmi,bmi2")))
#else
#define SD_FUSES
#endif

enum { SD_ZERO_DIVISION = 1, SD_NO_MEMORY = 2, SD_OUT_OF_BOUNDS = 3 };

/* Where a kernel goes whose division, memory or index is in error: to the call from Python. */
static SD_THREAD jmp_buf sd_exit;

#if defined(__GNUC__)
__attribute__((noreturn, cold, noinline))
#endif
static void sd_fail(int why) { longjmp(sd_exit, why); }

/* With SD_BOUNDS, which index left its array: file and line of the kernel's source. */
static SD_THREAD const char *sd_file = "";
static SD_THREAD int sd_line;

#ifdef SD_BOUNDS
static inline int64_t sd_at(int64_t i, int64_t n, const char *file, int line) {
    if (i < 0 || i >= n) {
        sd_file = file;
        sd_line = line;
        sd_fail(SD_OUT_OF_BOUNDS);
    }
    return i;
}
#define SD_AT(i, n) sd_at(i, n, __FILE__, __LINE__)
#else
#define SD_AT(i, n) (i)
#endif

#define AT1(a, i) (a).data[SD_AT(i, (a).n0)]
#define AT2(a, i, j) (a).data[SD_AT(i, (a).n0) * (a).n1 + SD_AT(j, (a).n1)]
#define AT3(a, i, j, k) \
    (a).data[(SD_AT(i, (a).n0) * (a).n1 + SD_AT(j, (a).n1)) * (a).n2 + SD_AT(k, (a).n2)]
#define AT4(a, i, j, k, l) \
    (a).data[((SD_AT(i, (a).n0) * (a).n1 + SD_AT(j, (a).n1)) * (a).n2 + SD_AT(k, (a).n2)) * (a).n3 \
             + SD_AT(l, (a).n3)]
#define STRIDED1(a, i) (a).data[SD_AT(i, (a).n0) * (a).s0]
#define STRIDED2(a, i, j) (a).data[SD_AT(i, (a).n0) * (a).s0 + SD_AT(j, (a).n1) * (a).s1]
#define STRIDED3(a, i, j, k) \
    (a).data[SD_AT(i, (a).n0) * (a).s0 + SD_AT(j, (a).n1) * (a).s1 + SD_AT(k, (a).n2) * (a).s2]
#define SD_STRIDED1(type, a) ((type){(a).data, (a).n0, 1})
#define SD_STRIDED2(type, a) ((type){(a).data, (a).n0, (a).n1, (a).n1, 1})
#define SD_STRIDED3(type, a) ((type){(a).data, (a).n0, (a).n1, (a).n2, (a).n1 * (a).n2, (a).n2, 1})

/* A bound of a slice, as Python takes it, and the length of the slice. */
static inline int64_t sd_clip(int64_t i, int64_t n) {
    if (i < 0) i += n;
    return i < 0 ? 0 : i > n ? n : i;
}
static inline int64_t sd_length(int64_t low, int64_t high, int64_t n) {
    low = sd_clip(low, n);
    high = sd_clip(high, n);
    return high > low ? high - low : 0;
}

/* Memory of kernels: blocks from which is taken in order, given back as a stack. */
typedef struct { int block; size_t used; } sd_mark;
enum { SD_BLOCKS = 40 };
static SD_THREAD struct {
    char *base[SD_BLOCKS];
    size_t size[SD_BLOCKS], used;
    int block;
} sd_heap;

static inline sd_mark sd_begin(void) { return (sd_mark){sd_heap.block, sd_heap.used}; }
static inline void sd_end(sd_mark mark) {
    sd_heap.block = mark.block;
    sd_heap.used = mark.used;
}
#if defined(__GNUC__)
__attribute__((noinline))
#endif
static void *sd_more(size_t bytes) {
    for (;;) {
        int next = sd_heap.base[0] ? sd_heap.block + 1 : 0;
        if (next == SD_BLOCKS) sd_fail(SD_NO_MEMORY);
        if (!sd_heap.base[next] || sd_heap.size[next] < bytes) {
            size_t size = next ? 2 * sd_heap.size[next - 1] : (size_t)1 << 16;
            if (size < bytes) size = bytes;
            free(sd_heap.base[next]);
            sd_heap.base[next] = malloc(size);
            if (!sd_heap.base[next]) sd_fail(SD_NO_MEMORY);
            sd_heap.size[next] = size;
        }
        sd_heap.block = next;
        sd_heap.used = bytes;
        return sd_heap.base[next];
    }
}
static inline void *sd_new(int64_t count, size_t size) {
    if (count < 0) count = 0;
    size_t bytes = ((size_t)count * size + 31) & ~(size_t)31;
    int block = sd_heap.block;
    if (!sd_heap.base[block] || bytes > sd_heap.size[block] - sd_heap.used) return sd_more(bytes);
    void *at = sd_heap.base[block] + sd_heap.used;
    sd_heap.used += bytes;
    return at;
}
static inline void *sd_zeros(int64_t count, size_t size) {
    void *at = sd_new(count, size);
    if (count > 0) memset(at, 0, (size_t)count * size);
    return at;
}
static inline double *sd_ones_f8(int64_t count) {
    double *at = sd_new(count, sizeof *at);
    for (int64_t k = 0; k < count; k++) at[k] = 1.0;
    return at;
}
static inline bool *sd_ones_b1(int64_t count) {
    bool *at = sd_new(count, sizeof *at);
    for (int64_t k = 0; k < count; k++) at[k] = true;
    return at;
}
#define SD_GROW(list, size) \
    if ((list).n0 == (list).room) { \
        int64_t room_ = (list).room ? 2 * (list).room : 16; \
        void *data_ = sd_new(room_, size); \
        if ((list).n0) memcpy(data_, (list).data, (size_t)(list).n0 * (size)); \
        (list).data = data_; \
        (list).room = room_; \
    }

/* Python's max and min: the first of equal ones, and of a NaN and a number the first. */
static inline double sd_max_f8(double a, double b) { return b > a ? b : a; }
static inline double sd_min_f8(double a, double b) { return b < a ? b : a; }
static inline float sd_max_f4(float a, float b) { return b > a ? b : a; }
static inline float sd_min_f4(float a, float b) { return b < a ? b : a; }
static inline int64_t sd_max_i8(int64_t a, int64_t b) { return b > a ? b : a; }
static inline int64_t sd_min_i8(int64_t a, int64_t b) { return b < a ? b : a; }
static inline int64_t sd_abs(int64_t a) { return a < 0 ? -a : a; }

static inline double sd_divided(double a, double b) {
    if (b == 0.0) sd_fail(SD_ZERO_DIVISION);
    return a / b;
}
static inline float sd_divided_f4(float a, float b) {
    if (b == 0.0f) sd_fail(SD_ZERO_DIVISION);
    return a / b;
}
/* Division of integers towards minus infinity, and what it leaves. */
static inline int64_t sd_quotient(int64_t a, int64_t b) {
    if (b == 0) sd_fail(SD_ZERO_DIVISION);
    int64_t q = a / b;
    return q - (a % b != 0 && (a < 0) != (b < 0));
}
static inline int64_t sd_remainder(int64_t a, int64_t b) {
    if (b == 0) sd_fail(SD_ZERO_DIVISION);
    int64_t r = a % b;
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}
