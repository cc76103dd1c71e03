// The mesh: tiles as they come and go, their materials, and what is known of them.

import { Color, Matrix4, Mesh, Sphere, Vector3 } from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'meshoptimizer/decoder';
import { TilesRenderer } from '3d-tiles-renderer/three';
import { boundary, MODES, shared, surface, wire } from './material.js';
import { classTexture, distinct, rampTexture } from './ramps.js';
import { source } from './source.js';

/** Linear light as sRGB, both from 0 to 1. */
const encoded = x => x <= 0.0031308 ? 12.92 * x : 1.055 * x ** ( 1 / 2.4 ) - 0.055;

/** Triangles that are drawn at most, as far as levels of detail allow. */
const MOST_TRIANGLES = 6e6;

/** Number of values looked at for the range of a column. */
const SAMPLES = 20000;

const wireMaterial = wire();

/** Number of decimals of a lattice step. */
export function decimals( step ) {

	for ( let n = 0; n < 12; n ++ ) if ( Math.abs( step * 10 ** n - Math.round( step * 10 ** n ) ) < 1e-9 * 10 ** n * step ) return n;
	return 12;

}

export class MeshView {

	/** `changed` is called when something new is to be drawn, `failed` with a message when something cannot be. */
	constructor( renderer, camera, { changed, failed, opened } ) {

		const from = source();
		this.changed = changed;
		this.embedded = from.embedded;
		this.mode = 'plain';
		this.wireframe = false;
		this.edges = false;
		this.ranges = new Map();
		this.missing = new Set();
		this.detail = 1.5;
		this.coarser = 1;
		this.info = {};
		shared.uRamp.value = rampTexture();
		shared.uClasses.value = classTexture();

		const tiles = this.tiles = new TilesRenderer( from.url );
		tiles.registerPlugin( from.plugin );
		const loader = new GLTFLoader( tiles.manager );
		loader.setMeshoptDecoder( MeshoptDecoder );
		tiles.manager.addHandler( /\.(gltf|glb)$/, loader );
		tiles.registerPlugin( { name: 'MATERIALS', processTileModel: ( scene, tile ) => this.#dress( scene, tile ) } );
		tiles.lruCache.maxSize = Infinity;
		tiles.lruCache.minSize = 0;
		tiles.setCamera( camera );
		tiles.setResolutionFromRenderer( camera, renderer );
		tiles.addEventListener( 'needs-update', changed );
		tiles.addEventListener( 'load-model', changed );
		tiles.addEventListener( 'dispose-model', ( { tile } ) => tile.surface = tile.wires = null );
		tiles.addEventListener( 'tile-visibility-change', ( { tile, visible } ) => this.#shown( tile, visible ) );
		tiles.addEventListener( 'load-root-tileset', ( { tileset } ) => opened( this.#open( tileset ) ) );
		tiles.addEventListener( 'load-error', ( { tile, error, url } ) => this.#missing( tile, error, url, failed ) );
		this.budget = 1024;

	}

	/** Bytes of tiles that the browser may hold, in MiB. */
	set budget( mib ) {

		const cache = this.tiles.lruCache;
		this.mib = mib;
		cache.maxBytesSize = mib * 2 ** 20;
		cache.minBytesSize = 0.7 * mib * 2 ** 20;
		this.changed();

	}

	get budget() { return this.mib; }

	/** Begins with another camera. */
	use( camera, renderer ) {

		for ( const other of [ ...this.tiles.cameras ] ) this.tiles.deleteCamera( other );
		this.tiles.setCamera( camera );
		this.tiles.setResolutionFromRenderer( camera, renderer );

	}

	#open( tileset ) {

		const noted = tileset.extras?.outcrop ?? {};
		this.info = {
			triangles: 0, columns: [], crs: null, epsg: null, source: 'mesh',
			...noted,
			origin: noted.origin ?? [ 0, 0, 0 ],
			step: noted.step?.[ 0 ] ?? 0,
		};
		// Rounded coordinates have as many decimals as are right.
		this.decimals = this.info.step > 0 ? this.info.exact === false ? Math.max( 0, Math.floor( - Math.log10( 2 * this.info.step ) ) ) : decimals( this.info.step ) : 3;
		this.height = { low: 0, high: 1 };
		const sphere = new Sphere();
		this.tiles.getBoundingSphere( sphere );
		this.sphere = sphere;
		const box = { min: new Vector3(), max: new Vector3() };
		const bounds = tileset.root.boundingVolume.box;
		if ( bounds ) {

			const half = new Vector3( ...[ 0, 1, 2 ].map( k => Math.abs( bounds[ 3 + k ] ) + Math.abs( bounds[ 6 + k ] ) + Math.abs( bounds[ 9 + k ] ) ) );
			box.min.fromArray( bounds ).sub( half );
			box.max.fromArray( bounds ).add( half );

		} else {

			box.min.copy( sphere.center ).subScalar( sphere.radius );
			box.max.copy( sphere.center ).addScalar( sphere.radius );

		}

		this.box = box;
		return this.info;

	}

	// Missing tiles.

	#missing( tile, error, url, failed ) {

		if ( ! tile ) {

			failed( null, `The mesh cannot be loaded: ${ error?.message ?? error }` );
			return;

		}

		const name = tile.content?.uri ?? String( url );
		this.missing.add( tile );
		// The coarser tile stays, instead of a hole.
		if ( tile.parent ) tile.parent.geometricError = 0;
		failed( name, tile.parent ? 'the mesh is coarser there' : 'it is the coarsest one, so nothing can be shown' );
		this.changed();

	}

	/** Tries missing tiles again. */
	retry() {

		for ( const tile of this.missing ) if ( tile.parent ) tile.parent.geometricError = tile.parent.measuredError ?? tile.parent.geometricError;
		this.missing.clear();
		this.tiles.resetFailedTiles();
		this.changed();

	}

	// Tiles.

	/** Gives a new tile our materials. */
	#dress( scene, tile ) {

		const matrix = new Matrix4();
		scene.updateMatrixWorld( true );
		for ( let at = tile; at; at = at.parent ) at.measuredError ??= at.geometricError;
		const number = tile.content.uri.match( /(\d+)[^\d]*$/ )?.[ 1 ] ?? 0;
		tile.number = Number( number );
		const found = [];
		scene.traverse( object => ( object.isMesh || object.isLineSegments ) && found.push( object ) );
		for ( const object of found ) {

			object.material.dispose();
			// The scene stands in the frame of the mesh: its matrix has the turn to z-up.
			matrix.copy( object.matrixWorld );
			object.userData.place = new Vector3().setFromMatrixPosition( matrix );
			if ( object.isLineSegments ) {

				object.material = boundary();
				object.visible = this.edges;
				object.raycast = () => {};
				object.renderOrder = 1;

			} else {

				const colors = Boolean( object.geometry.attributes.color );
				object.material = surface( colors, matrix.elements[ 14 ], new Color() );
				tile.surface = object;
				this.#color( tile );

			}

		}

	}

	/** The attribute of a column in tiles. */
	#attribute( geometry, name ) {

		const column = this.info.columns.find( c => c.name === name );
		return geometry.attributes[ ( column?.attribute ?? '_' + name ).toLowerCase() ];

	}

	#color( tile ) {

		const { geometry, material } = tile.surface;
		const values = this.mode.startsWith( 'column:' ) && this.#attribute( geometry, this.mode.slice( 7 ) );
		if ( values ) geometry.setAttribute( 'value', values );
		else geometry.deleteAttribute( 'value' );
		const number = this.mode === 'level' ? 3 * ( tile.extras?.outcrop?.level ?? tile.internal.depth ) : tile.number;
		material.uniforms.uTile.value.setRGB( ...distinct( number ) );

	}

	/** A tile appears or disappears. */
	#shown( tile, visible ) {

		this.changed();
		if ( visible && tile.surface ) this.#wires( tile );

	}

	#wires( tile ) {

		if ( this.wireframe && ! tile.wires ) {

			tile.wires = new Mesh( tile.surface.geometry, wireMaterial );
			tile.wires.raycast = () => {};
			tile.wires.renderOrder = 2;
			tile.surface.add( tile.wires );
			tile.wires.updateMatrixWorld();

		}

		if ( tile.wires ) tile.wires.visible = this.wireframe;

	}

	/** All tiles that are in memory. */
	#each( visit ) {

		this.tiles.forEachLoadedModel( ( scene, tile ) => visit( tile, scene ) );

	}

	/** Colours by plain, color, height, tile, level, or column:NAME. */
	colorBy( mode ) {

		this.mode = mode;
		const name = mode.startsWith( 'column:' ) ? mode.slice( 7 ) : null;
		shared.uMode.value = name ? ( this.isClass( name ) ? MODES.class : MODES.value ) : MODES[ mode ] ?? 0;
		this.#each( tile => tile.surface && this.#color( tile ) );
		const range = this.range( mode );
		if ( range ) this.setRange( mode, range.low, range.high );
		this.changed();

	}

	isClass( name ) { return name === 'classification'; }

	/** The values at the ends of the ramp; of a column less its offset. */
	range( mode ) {

		if ( ! this.ranges.has( mode ) ) {

			const measured = this.#measure( mode );
			if ( ! measured ) return null;
			this.ranges.set( mode, measured );

		}

		return this.ranges.get( mode );

	}

	setRange( mode, low, high ) {

		this.ranges.set( mode, { low, high } );
		shared.uRange.value.set( low, high, 0, 0 );
		this.changed();

	}

	/** Range of a column, or of heights, without the outermost hundredths, from the coarsest tile in memory. */
	#measure( mode ) {

		if ( mode !== 'height' && ! mode.startsWith( 'column:' ) ) return null;
		let coarsest = null;
		this.#each( tile => {

			if ( tile.surface && ( ! coarsest || tile.internal.depth < coarsest.internal.depth ) ) coarsest = tile;

		} );
		if ( ! coarsest ) return null;
		const { geometry, userData, matrixWorld } = coarsest.surface;
		const attribute = mode === 'height' ? geometry.attributes.position : this.#attribute( geometry, mode.slice( 7 ) );
		if ( ! attribute ) return null;
		const stride = Math.max( 1, Math.floor( attribute.count / SAMPLES ) );
		const values = [];
		const at = new Vector3();
		for ( let n = 0; n < attribute.count; n += stride ) {

			const value = mode === 'height' ? at.fromBufferAttribute( attribute, n ).applyMatrix4( matrixWorld ).z : attribute.getX( n );
			if ( Number.isFinite( value ) ) values.push( value );

		}

		values.sort( ( a, b ) => a - b );
		const cut = Math.floor( values.length / 100 );
		const [ low, high ] = [ values[ cut ] ?? 0, values[ values.length - 1 - cut ] ?? 1 ];
		return { low, high: high > low ? high : low + 1, place: userData.place };

	}

	/** The classes that occur in tiles in memory. */
	classes( name ) {

		const found = new Set();
		this.#each( tile => {

			const attribute = tile.surface && this.#attribute( tile.surface.geometry, name );
			for ( let n = 0; attribute && n < attribute.count; n += 1 + ( attribute.count >> 14 ) ) found.add( attribute.getX( n ) );

		} );
		return [ ...found ].sort( ( a, b ) => a - b );

	}

	set showWires( on ) {

		this.wireframe = on;
		for ( const tile of this.tiles.visibleTiles ) if ( tile.surface ) this.#wires( tile );
		this.#each( tile => tile.wires && ( tile.wires.visible = on ) );
		this.changed();

	}

	set showEdges( on ) {

		this.edges = on;
		this.#each( ( tile, scene ) => scene.traverse( object => object.isLineSegments && ( object.visible = on ) ) );
		this.changed();

	}

	// Each frame.

	/** Chooses the tiles that are drawn, for errors that may be larger by a factor while the view moves. */
	update( camera, renderer, factor ) {

		this.tiles.setResolutionFromRenderer( camera, renderer );
		this.tiles.errorTarget = this.detail * Math.max( this.coarser, factor );
		this.tiles.update();

	}

	/** Makes the next frames coarser if there are too many triangles, or less so if there are few. */
	limit( triangles ) {

		const before = this.coarser;
		if ( triangles > MOST_TRIANGLES ) this.coarser = Math.min( this.coarser * 1.25, 64 );
		else if ( triangles < 0.6 * MOST_TRIANGLES && this.coarser > 1 ) this.coarser = Math.max( this.coarser / 1.1, 1 );
		if ( this.coarser !== before ) this.changed();

	}

	/** Counts of what is drawn. */
	stats() {

		const { tiles } = this;
		let triangles = 0;
		for ( const tile of tiles.visibleTiles ) triangles += ( tile.surface?.geometry.index?.count ?? 0 ) / 3;
		const { stats } = tiles;
		return {
			triangles,
			tiles: tiles.visibleTiles.size,
			loading: stats.queued + stats.downloading + stats.parsing,
			held: tiles.lruCache.itemSet.size,
			bytes: tiles.lruCache.cachedBytes,
			full: stats.refused > 0,
			coarser: this.coarser,
			missing: this.missing.size,
		};

	}

	// Coordinates.

	/** Local coordinates as those of the scan. */
	toScan( local ) { return [ local.x, local.y, local.z ].map( ( x, k ) => x + this.info.origin[ k ] ); }

	/** The scan's coordinates as local ones. */
	toLocal( scan ) { return new Vector3( ...scan.map( ( x, k ) => x - this.info.origin[ k ] ) ); }

	/**
	 * A vertex of a tile: its exact coordinates, by the whole numbers that the tile has of the lattice, and its
	 * values. The renderer's own positions are rounded.
	 */
	vertex( object, index ) {

		const { geometry, matrixWorld: { elements: m }, userData: { place, tile } } = object;
		const { position, _low: low } = geometry.attributes;
		const p = [ position.getX( index ), position.getY( index ), position.getZ( index ) ];
		if ( low ) [ low.getX( index ), low.getY( index ), low.getZ( index ) ].forEach( ( x, k ) => p[ k ] += x );
		const local = new Vector3( ...[ 0, 1, 2 ].map( k => m[ k ] * p[ 0 ] + m[ 4 + k ] * p[ 1 ] + m[ 8 + k ] * p[ 2 ] + [ place.x, place.y, place.z ][ k ] ) );
		const { step } = this.info;
		if ( step > 0 ) [ 'x', 'y', 'z' ].forEach( a => local[ a ] = Math.round( local[ a ] / step ) * step );
		const scan = this.toScan( local );
		const values = this.info.columns.map( ( { name, offset = 0 } ) => {

			const attribute = this.#attribute( geometry, name );
			return attribute ? [ name, attribute.getX( index ) + offset ] : null;

		} ).filter( Boolean );
		const color = geometry.attributes.color;
		if ( color ) values.unshift( [ 'color', [ color.getX( index ), color.getY( index ), color.getZ( index ) ].map( x => Math.round( 255 * encoded( x ) ) ).join( ' ' ) ] );
		return { local, scan, values, level: tile?.extras?.outcrop?.level, text: scan.map( x => x.toFixed( this.decimals ) ) };

	}

}
