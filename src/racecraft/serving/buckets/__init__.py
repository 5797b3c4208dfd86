"""Folders of this machine behind an S3 address, for programs that know no other. Begin with `server.py`.

server.py          what is listened to, and which request is answered by whom
bucket_folder.py   a folder as a bucket: keys are its files
uploads.py         uploads in parts
answers.py         one function for each request of S3 that is understood
xml.py             what S3 says in XML, and its errors
bodies.py          bodies as clients send them: plain, chunked, AWS's own chunks
signature.py       who asks: AWS's signature, version 4
"""
