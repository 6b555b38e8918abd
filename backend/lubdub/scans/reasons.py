"""Every sentence this room says to a person: why a file cannot be read, and why a scan is refused or doubted."""

from __future__ import annotations

from collections.abc import Mapping

from lubdub.results import Reason, ScanUnreadable

_EXPORT = "Please open it in your scanning app and export the scan as a PLY, OBJ, GLB or STL file."
_AGAIN = "Please export the scan again and upload the new file."

UNREADABLE: Mapping[str, str] = {
    "empty": f"This file is empty. {_AGAIN}",
    "too_large": "This file is larger than 300 MB. Please export the scan at a lower quality, or crop it to the chest.",
    "unknown": f"We do not know this kind of file. {_EXPORT}",
    "picture": f"This file is a picture, not a 3D scan. {_EXPORT}",
    "video": f"This file is a video, not a 3D scan. {_EXPORT}",
    "pdf": f"This file is a PDF document, not a 3D scan. {_EXPORT}",
    "page": f"This file is a web page, not a 3D scan. Perhaps the download did not work. {_EXPORT}",
    "usdz": f"This is a USDZ file, which we cannot read. {_EXPORT}",
    "gltf_text": f"This is a glTF text file that needs other files beside it. {_EXPORT}",
    "fbx": f"This is an FBX file, which we cannot read. {_EXPORT}",
    "las": f"This is a LAS or LAZ file from surveying, which we cannot read. {_EXPORT}",
    "e57": f"This is an E57 file from surveying, which we cannot read. {_EXPORT}",
    "dae": f"This is a DAE (Collada) file, which we cannot read. {_EXPORT}",
    "3mf": f"This is a 3MF file for printing, which we cannot read. {_EXPORT}",
    "off": f"This is an OFF file, which we cannot read. {_EXPORT}",
    "dicom": f"This is a DICOM medical image, not a scan of the skin. {_EXPORT}",
    "record3d": f"This is a Record3D recording, which we cannot read. {_EXPORT}",
    "packed": "This is a packed file that we cannot open. Please unpack it and upload the scan inside it.",
    "splat": (
        "This is a Gaussian splat, a kind of picture with no skin surface in it. "
        "Please scan again in mesh mode and export a PLY, OBJ, GLB or STL file."
    ),
    "draco": (
        "This GLB file is compressed in a way we cannot read. "
        "Please export it without compression, or as a PLY, OBJ or STL file."
    ),
    "zip_none": f"There is no scan in this ZIP file. {_EXPORT}",
    "zip_many": "There is more than one scan in this ZIP file. Please upload one scan at a time.",
    "zip_unsafe": "This ZIP file is not safe to unpack. Please unpack it yourself and upload the scan inside it.",
    "other_files": f"This file needs other files that were not uploaded. {_EXPORT}",
    "cut_short": f"This file is cut short: it says it holds more than it does. {_AGAIN}",
    "too_many_points": "This scan has more than 5 million points. Please export it at a lower quality.",
    "too_many_faces": "This scan has more than 10 million faces. Please export it at a lower quality.",
    "no_points": f"There are no points in this file. {_AGAIN}",
    "bad_number": f"This file holds coordinates that are not usable numbers. {_AGAIN}",
    "bad_face": f"This file holds faces that do not fit its points, so it is damaged. {_AGAIN}",
    "bad_header": f"The beginning of this file is damaged, so we cannot tell what is in it. {_AGAIN}",
    "bad_unit": "The unit must be m, cm or mm. Please choose one of these, or leave it out and let us find it.",
}


def unreadable(what: str) -> ScanUnreadable:
    """The error for one key of UNREADABLE."""
    return ScanUnreadable(UNREADABLE[what])


def unit_implausible(size_in_words: str) -> Reason:
    """The body would be far too large or too small, or two units would both be possible."""
    return Reason(
        "unit_implausible",
        f"We cannot tell how large this body is: {size_in_words}.",
        "Please say if the file is in metres, centimetres or millimetres, or scan again with an app that measures.",
    )


def too_few_points(count: int) -> Reason:
    """Too little was left to know the chest's shape."""
    return Reason(
        "too_few_points",
        f"There are only {count} usable points on the body in this scan.",
        "Please scan again, slowly, from about an arm's length away.",
    )


NO_BODY_FOUND = Reason(
    "no_body_found",
    "We could not find a body in this scan.",
    "Please scan the bare chest from neck to navel and keep other things out of the picture.",
)

LANDMARKS_OFF_SCAN = Reason(
    "landmarks_off_scan",
    "The marked points do not lie on this scan.",
    "Please check that the points were marked on this very scan and in its own unit, or mark them again.",
)

SPARSE_SCAN = Reason(
    "sparse_scan",
    "The points of this scan are far apart, so small shapes are missing.",
    "If you can, scan again more slowly and a little closer.",
)

NOISY_SCAN = Reason(
    "noisy_scan",
    "The skin in this scan is very rough. The person or the phone may have moved.",
    "If you can, scan again in even light while the person lies still and breathes calmly.",
)

TWO_BODIES = Reason(
    "two_bodies",
    "There are two large shapes in this scan and we kept only one of them.",
    "Please check that the picture shows the right person, or scan again with nobody else in view.",
)
