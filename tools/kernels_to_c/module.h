/* From Python's objects to the kernels' arguments, and back. */
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#define NPY_TARGET_VERSION NPY_2_0_API_VERSION
#include <numpy/arrayobject.h>

static void sd_wrong(const char *kernel, int argument, PyObject *given) {
    PyErr_Format(PyExc_TypeError, "%s: argument %d is of another type than in signatures.txt: %R", kernel,
                 argument + 1, (PyObject *)Py_TYPE(given));
}
static int sd_type_f8(int type) { return type == NPY_DOUBLE; }
static int sd_type_f4(int type) { return type == NPY_FLOAT; }
static int sd_type_i8(int type) {
    return type == NPY_INT64 || (sizeof(long) == 8 && type == NPY_LONG) || type == NPY_LONGLONG;
}
static int sd_type_u1(int type) { return type == NPY_UBYTE; }
static int sd_type_i1(int type) { return type == NPY_BYTE; }
static int sd_type_b1(int type) { return type == NPY_BOOL; }

/* Arrays that were converted for a call, which end with it. */
typedef struct { PyObject *array[32]; int n; } sd_held;
static void sd_let_go(sd_held *held) {
    while (held->n > 0) {
        PyArrayObject *copy = (PyArrayObject *)held->array[--held->n];
        PyArray_ResolveWritebackIfCopy(copy);
        Py_DECREF(copy);
    }
}

/* The array if it has the type, dimensions and layout. Or else such a copy: of one that the kernel does
 * not change where the type holds its numbers; of another layout, and written back, where it does.
 * Otherwise NULL. */
static PyArrayObject *sd_array(PyObject *o, int type, int (*of_type)(int), int dims, int contiguous,
                               int change, sd_held *held) {
    if (!PyArray_Check(o)) return NULL;
    PyArrayObject *a = (PyArrayObject *)o;
    if (PyArray_NDIM(a) != dims) return NULL;
    int flags = NPY_ARRAY_ALIGNED | (contiguous ? NPY_ARRAY_C_CONTIGUOUS : 0) |
                (change ? NPY_ARRAY_WRITEABLE : 0);
    int good = of_type(PyArray_TYPE(a)) && PyArray_CHKFLAGS(a, flags) && !PyArray_ISBYTESWAPPED(a);
    if (good && !contiguous)
        for (int k = 0; k < dims; k++) good &= PyArray_STRIDE(a, k) % PyArray_ITEMSIZE(a) == 0;
    if (good) return a;
    if (held->n == 32) return NULL;
    if (change ? !of_type(PyArray_TYPE(a)) || !PyArray_ISWRITEABLE(a)
               : !PyArray_CanCastSafely(PyArray_TYPE(a), type))
        return NULL;
    PyObject *copy = PyArray_FROM_OTF(
        o, type, change ? NPY_ARRAY_CARRAY | NPY_ARRAY_WRITEBACKIFCOPY : NPY_ARRAY_CARRAY_RO);
    if (!copy) return NULL;
    held->array[held->n++] = copy;
    return (PyArrayObject *)copy;
}
static int sd_get_f8(PyObject *o, double *x) {
    *x = PyFloat_AsDouble(o);
    return *x == -1.0 && PyErr_Occurred() ? -1 : 0;
}
static int sd_get_f4(PyObject *o, float *x) {
    double wide;
    if (sd_get_f8(o, &wide)) return -1;
    *x = (float)wide;
    return 0;
}
static int sd_get_i8(PyObject *o, int64_t *x) {
    PyObject *whole = PyNumber_Index(o);
    if (!whole) return -1;
    *x = PyLong_AsLongLong(whole);
    Py_DECREF(whole);
    return *x == -1 && PyErr_Occurred() ? -1 : 0;
}
static int sd_get_b1(PyObject *o, bool *x) {
    int true_ = PyObject_IsTrue(o);
    *x = true_ == 1;
    return true_ < 0 ? -1 : 0;
}
static int sd_get_u1(PyObject *o, uint8_t *x) {
    int64_t i;
    if (sd_get_i8(o, &i)) return -1;
    *x = (uint8_t)i;
    return 0;
}
static PyObject *sd_py_f8(double x) { return PyFloat_FromDouble(x); }
static PyObject *sd_py_f4(float x) { return PyFloat_FromDouble((double)x); }
static PyObject *sd_py_i8(int64_t x) { return PyLong_FromLongLong(x); }
static PyObject *sd_py_b1(bool x) { return PyBool_FromLong(x); }
static PyObject *sd_copied(const void *data, int type, int dims, npy_intp *sizes) {
    PyObject *o = PyArray_SimpleNew(dims, sizes, type);
    if (o) memcpy(PyArray_DATA((PyArrayObject *)o), data, (size_t)PyArray_NBYTES((PyArrayObject *)o));
    return o;
}
static PyObject *sd_failed(const char *kernel, int why, const char *file, int line) {
    if (why == SD_NO_MEMORY) return PyErr_NoMemory();
    if (why == SD_ZERO_DIVISION)
        PyErr_SetString(PyExc_ZeroDivisionError, "division by zero");
    else
        PyErr_Format(PyExc_IndexError, "%s: index is out of bounds in %s, line %d", kernel, file, line);
    return NULL;
}
static PyObject *sd_count(const char *kernel, int wanted, Py_ssize_t given) {
    return PyErr_Format(PyExc_TypeError, "%s takes %d arguments, not %zd", kernel, wanted, given);
}
