"""The Zarr codec `btfkit.predictive`: `import btfkit_zarr`, and zarr-python reads and writes it.

Installed (`pip install ./python`), zarr-python finds it without the import. The bytes are described in
`docs/reference/codec.md`.
"""

import asyncio
from dataclasses import dataclass

import numpy as np
from zarr.abc.codec import ArrayBytesCodec
from zarr.registry import register_codec

from .layout import decode, encode

__all__ = ["PredictiveCodec", "decode", "encode"]


@dataclass(frozen=True)
class PredictiveCodec(ArrayBytesCodec):
    """Array to bytes, entropy coding and checksum included."""

    is_fixed_size = False

    channel_axis: bool

    @classmethod
    def from_dict(cls, data):
        return cls(**data["configuration"])

    def to_dict(self):
        return {"name": "btfkit.predictive", "configuration": {"channel_axis": self.channel_axis}}

    def compute_encoded_size(self, input_byte_length, chunk_spec):
        raise NotImplementedError  # it depends on the samples

    async def _decode_single(self, chunk_bytes, chunk_spec):
        dtype = chunk_spec.dtype.to_native_dtype()
        samples = await asyncio.to_thread(
            decode, chunk_bytes.to_bytes(), chunk_spec.shape, dtype, self.channel_axis
        )
        return chunk_spec.prototype.nd_buffer.from_ndarray_like(samples)

    async def _encode_single(self, chunk_array, chunk_spec):
        samples = np.asarray(chunk_array.as_ndarray_like())
        data = await asyncio.to_thread(encode, samples, self.channel_axis)
        return chunk_spec.prototype.buffer.from_bytes(data)


register_codec("btfkit.predictive", PredictiveCodec)
