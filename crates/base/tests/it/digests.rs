//! Digests of files and rules, against the vectors of FIPS 180-2.

use teachtree_base::digest::Digest;

fn of_fields(fields: &[&str]) -> String {
    let mut digest = Digest::default();
    fields.iter().for_each(|field| digest.field(field));
    digest.finish()
}

#[test]
fn bytes_have_the_beginning_of_their_published_sha_256() {
    let million = "a".repeat(1_000_000);
    let vectors = [
        ("", "e3b0c44298fc1c149afbf4c8996fb924"),
        ("abc", "ba7816bf8f01cfea414140de5dae2223"),
        ("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", "248d6a61d20638b8e5c026930c3e6039"),
        (&million, "cdc76e5c9914fb9281a1c7e284d73e67"),
    ];
    for (text, published) in vectors {
        for piece in [1, 63, 64, 1 << 16] {
            let mut digest = Digest::default();
            text.as_bytes().chunks(piece).for_each(|bytes| digest.bytes(bytes));
            assert_eq!(digest.finish(), published, "{} bytes in pieces of {piece}", text.len());
        }
    }
}

#[test]
fn fields_that_are_equal_when_joined_have_different_digests() {
    let fields: [&[&str]; 6] = [&["ab", "c"], &["a", "bc"], &["abc"], &["abc", ""], &["", "abc"], &["a\0b", "c"]];
    for (at, one) in fields.iter().enumerate() {
        assert_eq!(of_fields(one), of_fields(one));
        for other in &fields[at + 1..] {
            assert_ne!(of_fields(one), of_fields(other), "{one:?}, {other:?}");
        }
    }
}
